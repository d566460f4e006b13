#include "host/calibration/analysis/delimited.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include "host/core/config_error.h"

namespace tagwrench::study {
namespace {

constexpr std::string_view kSeparators = ";\t,";
constexpr std::size_t kRowsToTell = 20;  // the separator by
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

std::string_view trimmed(std::string_view text) noexcept {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string load(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw ConfigError(fmt::format("{}: a folder; name a CSV file", file.string()));
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ConfigError(fmt::format("{}: cannot be read; check the name", file.string()));
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kMaxBytes)
    throw ConfigError(fmt::format("{}: larger than 1 GB; cut it into pieces", file.string()));
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Line {
  std::string_view text;
  std::size_t number;
};

std::size_t fields_of(std::string_view line, char separator) {
  return static_cast<std::size_t>(std::count(line.begin(), line.end(), separator)) + 1;
}

char separator_of(const std::vector<Line>& lines) {
  const std::size_t rows = std::min(lines.size(), kRowsToTell);
  for (const char separator : kSeparators) {
    const std::size_t fields = fields_of(lines[0].text, separator);
    const bool even =
        std::all_of(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(rows),
                    [&](const Line& line) { return fields_of(line.text, separator) == fields; });
    if (fields > 1 && even) return separator;
  }
  // Uneven rows: the most frequent one, so that the row which is wrong can be named.
  return *std::max_element(kSeparators.begin(), kSeparators.end(), [&](char a, char b) {
    return fields_of(lines[0].text, a) < fields_of(lines[0].text, b);
  });
}

std::string shown(std::string_view field) {
  constexpr std::size_t kMax = 40;
  std::string text(field.substr(0, kMax));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ') c = '?';
  }
  return field.size() > kMax ? text + "..." : text;
}

}  // namespace

bool parse_number(std::string_view text, double& value) noexcept {
  text = trimmed(text);
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

DelimitedText::DelimitedText(const std::filesystem::path& file, char separator, std::size_t skip)
    : name_(file.string()), text_(load(file)) {
  std::string_view rest = text_;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  std::vector<Line> lines;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (number <= skip || trimmed(line).empty()) continue;
    if (line[0] == '#') {
      comments_.emplace_back(trimmed(line.substr(1)));
    } else {
      lines.push_back({line, number});
    }
  }
  if (lines.empty()) throw ConfigError(fmt::format("{}: no rows in it", name_));
  if (separator == 0) separator = separator_of(lines);

  columns_ = fields_of(lines[0].text, separator);
  if (columns_ < 2) {
    throw ConfigError(fmt::format(
        "{}:{}: only one column when split at '{}'; give the right --separator", name_,
        lines[0].number, separator == '\t' ? std::string("tab") : std::string(1, separator)));
  }
  fields_.reserve(lines.size() * columns_);
  for (const Line& line : lines) {
    const std::size_t count = fields_of(line.text, separator);
    if (count != columns_) {
      throw ConfigError(
          fmt::format("{}:{}: {} fields where the first row has {}; mend the row, or "
                      "give the right --separator",
                      name_, line.number, count, columns_));
    }
    std::string_view left = line.text;
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::size_t end = std::min(left.find(separator), left.size());
      fields_.push_back(trimmed(left.substr(0, end)));
      left.remove_prefix(std::min(end + 1, left.size()));
    }
    lines_.push_back(line.number);
  }
  double ignored = 0;
  const auto first_end = fields_.begin() + static_cast<std::ptrdiff_t>(columns_);
  if (std::none_of(fields_.begin(), first_end,
                   [&](std::string_view f) { return parse_number(f, ignored); })) {
    header_.assign(fields_.begin(), first_end);
    fields_.erase(fields_.begin(), first_end);
    lines_.erase(lines_.begin());
  }
  if (lines_.empty()) throw ConfigError(fmt::format("{}: a header, but no rows in it", name_));
}

std::string DelimitedText::place(std::size_t row) const {
  return fmt::format("{}:{}", name_, lines_[row]);
}

double DelimitedText::number(std::size_t row, std::size_t column, double largest) const {
  double value = 0;
  const std::string_view text = field(row, column);
  const bool finite = parse_number(text, value);
  if (finite && std::abs(value) <= largest) return value;
  const std::string which = header_.empty()
                                ? fmt::format("column {}", column + 1)
                                : fmt::format("column {} ({})", column + 1, shown(header_[column]));
  if (text.empty()) {
    throw ConfigError(
        fmt::format("{}: {} is empty; leave the row out or fill it in", place(row), which));
  }
  if (finite) {
    throw ConfigError(fmt::format(
        "{}: {} is '{}', which no instrument reads (at most {:g}); mend it or leave the row out",
        place(row), which, shown(text), largest));
  }
  const bool comma = text.find(',') != std::string_view::npos;
  throw ConfigError(fmt::format(
      "{}: {} is '{}', which is no finite number; {}", place(row), which, shown(text),
      comma ? "write decimal points, not commas" : "leave the row out, or name other columns"));
}

std::vector<std::size_t> DelimitedText::find(std::string_view columns) const {
  std::vector<std::size_t> found;
  const auto numbered = [&](std::string_view text) -> std::size_t {
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return 0;
    if (number < 1 || number > columns_) {
      throw ConfigError(
          fmt::format("{}: no column {}; it has 1 to {}", name_, shown(text), columns_));
    }
    return number;
  };
  for (std::string_view rest = columns; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    const std::string_view one = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const auto named = std::find(header_.begin(), header_.end(), one);
    if (named != header_.end()) {
      found.push_back(static_cast<std::size_t>(named - header_.begin()));
      continue;
    }
    const std::size_t dash = one.find('-');
    const std::size_t first = numbered(one.substr(0, dash));
    const std::size_t last =
        dash == std::string_view::npos ? first : numbered(one.substr(dash + 1));
    if (first == 0 || last < first) {
      throw ConfigError(fmt::format("{}: no column '{}'; name columns by number from 1 ('3-8'){}",
                                    name_, shown(one),
                                    header_.empty() ? "" : " or as its header does"));
    }
    for (std::size_t i = first; i <= last; ++i) found.push_back(i - 1);
  }
  if (found.empty()) throw ConfigError(fmt::format("{}: no columns named", name_));
  return found;
}

}  // namespace tagwrench::study
