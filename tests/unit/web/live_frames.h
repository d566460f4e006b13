// Frames as a pipeline logs them, made up.
#pragma once

#include <vector>

#include "host/web/server/live_feed.h"

namespace tagwrench::test {

/// A picture of one size, its track and its sample.
class LoggedPicture {
 public:
  LoggedPicture(int width, int height)
      : pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    frame.image = {pixels_.data(), width, height, width};
    sample.status = Status::ok;
    track.status = Status::ok;
  }

  /// `raw` has the whole picture's bytes; without, only `frame` is there.
  LoggedFrame logged(RawFrame raw = {}) const { return {frame, {}, raw, track, sample}; }
  std::vector<std::uint8_t>& pixels() { return pixels_; }

  Frame frame;
  Track track;
  Sample sample;

 private:
  std::vector<std::uint8_t> pixels_;
};

inline Sample numbered_sample(std::uint64_t number) {
  Sample sample;
  sample.sequence = number;
  sample.status = Status::ok;
  sample.wrench.setConstant(static_cast<double>(number));
  sample.deflection.setConstant(static_cast<double>(number));
  sample.latency_origin = TimePoint(std::chrono::milliseconds(10) * number);
  sample.output_time = sample.latency_origin + std::chrono::microseconds(700);
  return sample;
}

}  // namespace tagwrench::test
