#include "host/web/bridge/recording_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "host/core/config_error.h"
#include "host/web/bridge/job_command.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListed = 500;

bool is_plain(unsigned char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// As new_file() makes them.
bool is_recording_file(std::string_view file) {
  constexpr std::string_view kEnd = RecordingFolder::kExtension;
  return file.ends_with(kEnd) &&
         (is_recording_name(file) || is_recording_name(file.substr(0, file.size() - kEnd.size())));
}

constexpr double kMaxLeft_s = 1e7;

}  // namespace

fs::path usual_recording_folder() {
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && data[0] == '/') return fs::path(data) / "tagwrench/recordings";
  const char* home = std::getenv("HOME");
  if (home != nullptr && home[0] == '/')
    return fs::path(home) / ".local/share/tagwrench/recordings";
  return {};
}

bool is_recording_name(std::string_view name) {
  return !name.empty() && name.size() <= RecordingFolder::kMaxName &&
         is_plain(static_cast<unsigned char>(name.front())) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return is_plain(c) || c == '-' || c == '_' || c == '.';
         });
}

void check_recording_name(std::string_view name) {
  if (is_recording_name(name)) return;
  throw RequestRefused(
      "name: must be 1 to 64 letters, digits, -, _ and ., beginning with a letter or digit; choose "
      "another");
}

fs::path RecordingFolder::new_file(std::string_view name) const {
  check_recording_name(name);
  if (folder_.empty()) {
    throw ConfigError(
        "recordings: neither XDG_DATA_HOME nor HOME says where; name a folder with --recordings");
  }
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) {
    throw ConfigError("--recordings {}: cannot be made: {}; name a folder of yours",
                      folder_.string(), error.message());
  }
  std::string file(name);
  if (!file.ends_with(kExtension)) file += kExtension;
  if (fs::exists(fs::symlink_status(folder_ / file, error))) {
    throw RequestRefused(fmt::format(
        "name: there is a {} already, and a recording replaces nothing; choose another", file));
  }
  return folder_ / file;
}

nlohmann::json RecordingFolder::list() const {
  struct Found {
    std::string name;
    struct stat about {};
  };
  std::vector<Found> all;
  std::error_code error;
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    Found found{it->path().filename().string(), {}};
    if (!is_recording_file(found.name)) continue;
    if (::lstat(it->path().c_str(), &found.about) == 0 && S_ISREG(found.about.st_mode))
      all.push_back(std::move(found));
  }
  std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) {
    return a.about.st_mtime != b.about.st_mtime ? a.about.st_mtime > b.about.st_mtime
                                                : a.name < b.name;
  });
  if (all.size() > kMaxListed) all.resize(kMaxListed);
  nlohmann::json list = nlohmann::json::array();
  for (const Found& found : all) {
    list.push_back(
        {{"name", found.name},
         {"bytes", static_cast<std::uint64_t>(found.about.st_size)},
         {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(found.about.st_mtime))}});
  }
  return list;
}

nlohmann::json RunRecording::progress() const {
  const record::WriterState state = writer().state();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double speed = static_cast<double>(state.bytes) / std::max(1e-3, seconds);
  const double left = static_cast<double>(state.disk_free) / std::max(1.0, speed);
  return {{"file", name()},
          {"seconds", seconds},
          {"bytes", state.bytes},
          {"frames", state.frames},
          {"dropped", dropped_.load(std::memory_order_relaxed) + state.lost_frames},
          {"disk_left_s", std::min(left, kMaxLeft_s)}};
}

RunRecording::Ending RunRecording::finish() noexcept {
  const std::string trouble = writer().finish();
  const record::WriterState state = writer().state();
  if (!trouble.empty()) return {false, trouble};
  std::string line = fmt::format("{}: {} frames, {:.3g} MB", file_.string(), state.frames,
                                 1e-6 * static_cast<double>(state.bytes));
  if (state.lost_frames > 0)
    line += fmt::format("; the disk was too slow for {} of them", state.lost_frames);
  return {true, line};
}

}  // namespace tagwrench
