// A recording that a page began and a page ends, while the sensor runs. The file is that of
// `tagwrench record`.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/frame_log.h"
#include "host/record/writer.h"

namespace tagwrench {

class RunRecording final : public FrameLog {
 public:
  /// Makes the file. Throws ConfigError.
  RunRecording(const std::filesystem::path& file, const record::Head& head);

  // The loop's thread.
  void frame(const LoggedFrame& all) noexcept override;
  void missing(const Sample& sample) noexcept override;
  void disconnected(std::string_view detail) noexcept override;
  void reconnected(std::string_view detail) noexcept override;
  void note(std::string_view line) noexcept;

  // Any one thread.
  std::string name() const { return file_.filename().string(); }
  /// {"file","seconds","bytes","frames","dropped","disk_left_s"}
  nlohmann::json progress() const;
  bool failed() const noexcept { return writer_.state().failed; }
  std::string failure() const { return writer_.failure(); }
  /// Once the loop has let go of it. May take as long as the disk does. One line about what there
  /// is now, or what went wrong.
  struct Ending {
    bool whole = false;
    std::string line;
  };
  Ending finish() noexcept;

 private:
  TimePoint now_of_frames() const noexcept;

  std::filesystem::path file_;
  record::RecordingWriter writer_;
  TimePoint start_;
  Duration clock_{};  ///< of the frames less CLOCK_MONOTONIC
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace tagwrench
