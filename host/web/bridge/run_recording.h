// A recording that a page began and a page ends, while the sensor runs. The file is that of
// `tagwrench record`.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/recording/frame_recorder.h"

namespace tagwrench {

class RunRecording final : public record::FrameRecorder {
 public:
  /// Makes the file. Throws ConfigError.
  RunRecording(const std::filesystem::path& file, const record::Head& head);

  // The loop's thread.
  void frame(const LoggedFrame& all) noexcept override;

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
