// The folder in which pages keep recordings: what is in it, and what a new one may be called.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "host/recording/writer.h"

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
/// Throws RequestRefused.
void check_recording_name(std::string_view name);

// A recording that pages begin and end while the sensor runs; the file is that of `record`.

class RunRecording final : public record::FrameRecorder {
 public:
  /// Makes the file. Throws ConfigError.
  RunRecording(const std::filesystem::path& file, const record::Head& head)
      : FrameRecorder({.path = file}, head),
        file_(file),
        start_(std::chrono::steady_clock::now()) {}

  // The loop's thread.
  void frame(const LoggedFrame& all) noexcept override {
    dropped_.fetch_add(all.sample.dropped, std::memory_order_relaxed);
    FrameRecorder::frame(all);
  }

  // Any one thread.
  std::string name() const { return file_.filename().string(); }
  /// {"file","seconds","bytes","frames","dropped","disk_left_s"}
  nlohmann::json progress() const;
  bool failed() const noexcept { return writer().state().failed; }
  std::string failure() const { return writer().failure(); }
  /// Once the loop has let go of it. May take as long as the disk does. One line about what there
  /// is now, or what went wrong.
  struct Ending {
    bool whole = false;
    std::string line;
  };
  Ending finish() noexcept;

 private:
  std::filesystem::path file_;
  TimePoint start_;
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace tagwrench
