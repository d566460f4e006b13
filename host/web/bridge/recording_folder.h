// The folder in which pages keep recordings: what is in it, and what a new one may be called.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace tagwrench {

/// $XDG_DATA_HOME/tagwrench/recordings, else ~/.local/share/tagwrench/recordings.
std::filesystem::path usual_recording_folder();

class RecordingFolder {
 public:
  static constexpr std::size_t kMaxName = 64;
  static constexpr std::string_view kExtension = ".twr";

  explicit RecordingFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }

  /// The file of a new recording: the folder is made if it is not there. Throws RequestRefused: no
  /// name for a recording, or one that is taken; ConfigError: the folder cannot be had.
  std::filesystem::path new_file(std::string_view name) const;

  /// [{"name","bytes","date"}], the newest first; 500 at most.
  nlohmann::json list() const;

 private:
  std::filesystem::path folder_;
};

/// 1 to 64 letters, digits, '-', '_' and '.', the first none of the last three.
bool is_recording_name(std::string_view name);

}  // namespace tagwrench
