#include "host/recording/frame_recorder.h"

namespace tagwrench::record {

void FrameRecorder::frame(const LoggedFrame& all) noexcept {
  clock_ = all.frame.capture_time - all.frame.latency_origin;
  writer_.frame(all.frame, all.decoded, all.raw);
  writer_.track(all.track);
  writer_.sample(all.sample);
}

void FrameRecorder::missing(const Sample& sample) noexcept { writer_.missing(sample); }

void FrameRecorder::disconnected(std::string_view detail) noexcept {
  writer_.event(EventKind::disconnected, now_of_frames(), detail);
}

void FrameRecorder::reconnected(std::string_view detail) noexcept {
  writer_.event(EventKind::reconnected, now_of_frames(), detail);
}

void FrameRecorder::note(std::string_view line) noexcept {
  if (!line.empty()) writer_.event(EventKind::note, now_of_frames(), line);
}

TimePoint FrameRecorder::now_of_frames() const noexcept {
  return std::chrono::steady_clock::now() + clock_;
}

}  // namespace tagwrench::record
