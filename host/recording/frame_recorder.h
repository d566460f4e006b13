// What a pipeline tells of each frame, into a recording.
#pragma once

#include <string_view>

#include "host/core/frame_log.h"
#include "host/recording/writer.h"

namespace tagwrench::record {

class FrameRecorder : public FrameLog {
 public:
  /// Makes the file. Throws ConfigError.
  FrameRecorder(const WriterOptions& options, const Head& head) : writer_(options, head) {}

  // The loop's thread.
  void frame(const LoggedFrame& all) noexcept override;
  void missing(const Sample& sample) noexcept override;
  void disconnected(std::string_view detail) noexcept override;
  void reconnected(std::string_view detail) noexcept override;
  /// What people were told; an empty line is nothing.
  void note(std::string_view line) noexcept;

  RecordingWriter& writer() noexcept { return writer_; }
  const RecordingWriter& writer() const noexcept { return writer_; }

 private:
  TimePoint now_of_frames() const noexcept;

  RecordingWriter writer_;
  Duration clock_{};  ///< of the frames less CLOCK_MONOTONIC
};

}  // namespace tagwrench::record
