#include "host/source/frame_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

/// What a file holds is shown in a message: short and printable.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 40));
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < ' ' || c > 126; }, '?');
  return out;
}

std::optional<std::int64_t> nanoseconds(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  // Half the range: differences and sums with a present time must not overflow.
  if (error != std::errc{} || end != text.data() + text.size() || value < 0 ||
      value > INT64_MAX / 2) {
    return std::nullopt;
  }
  return value;
}

struct Entry {
  std::int64_t t_ns = 0;
  std::size_t line = 0;
};

using Entries = std::unordered_map<std::string_view, std::optional<Entry>>;

void take_line(std::string_view line, std::size_t number, const std::string& source,
               Entries& entries) {
  const auto comma = line.find(',');
  const auto time =
      comma == std::string_view::npos ? std::nullopt : nanoseconds(line.substr(comma + 1));
  if (!time) {
    throw ConfigError(
        fmt::format("{}:{}: '{}' is not file,t_ns with t_ns in whole nanoseconds; "
                    "correct the line",
                    source, number, shown(line)));
  }
  const auto entry = entries.find(line.substr(0, comma));
  if (entry == entries.end()) {
    throw ConfigError(
        fmt::format("{}:{}: there is no picture '{}' in the folder; remove the line "
                    "or add the file",
                    source, number, shown(line.substr(0, comma))));
  }
  if (entry->second) {
    throw ConfigError(fmt::format("{}:{}: '{}' was already on line {}; remove one of them", source,
                                  number, shown(entry->first), entry->second->line));
  }
  entry->second = Entry{*time, number};
}

}  // namespace

std::vector<Duration> parse_frame_times(std::string_view text, const std::string& source,
                                        std::span<const std::string> files) {
  Entries entries;
  for (const std::string& file : files) entries.emplace(file, std::nullopt);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || (number == 1 && line == "file,t_ns")) continue;
    take_line(line, number, source, entries);
  }
  std::vector<Duration> times;
  times.reserve(files.size());
  for (const std::string& file : files) {
    const auto& entry = entries.at(file);
    if (!entry) {
      throw ConfigError(fmt::format("{}: has no time for {}; add a line {},t_ns", source,
                                    shown(file), shown(file)));
    }
    const Duration time(entry->t_ns);
    if (!times.empty() && time <= times.back()) {
      throw ConfigError(
          fmt::format("{}:{}: t_ns {} of {} is not after {}, that of the picture "
                      "before it; times must increase in the order of the names",
                      source, entry->line, entry->t_ns, shown(file), times.back().count()));
    }
    times.push_back(time);
  }
  return times;
}

}  // namespace tagwrench
