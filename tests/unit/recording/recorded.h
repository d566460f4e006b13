// Small recordings for the tests of this room.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/core/config_error.h"
#include "host/recording/reader.h"
#include "host/recording/writer.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::record::test {

inline constexpr int kWidth = 32;
inline constexpr int kHeight = 24;

class Folder : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name = "r.twr") const { return folder_ / name; }

  tagwrench::test::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

inline TimePoint at_ms(std::int64_t ms) { return TimePoint(std::chrono::milliseconds(ms)); }

inline Head head(Keep keep = Keep::raw) {
  Head head;
  head.created = "2026-01-31T12:00:00Z";
  head.software = "0.0";
  head.source = "a test";
  head.width = kWidth;
  head.height = kHeight;
  head.period = std::chrono::milliseconds(40);
  head.keep = keep;
  head.sensor_name = "sensor.yaml";
  head.sensor_yaml = "camera: {}\n";
  head.appearance = std::string("\x89PNG\0\n", 6);
  head.measured = {{"target.yaml", "format: x\n"}, {"rest.png", std::string("\x89\0", 2)}};
  head.more = {{"board", "none"}};
  return head;
}

/// A grey picture that is different for every number.
inline std::vector<std::uint8_t> picture(int number) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint8_t>(7 * i + 31 * static_cast<std::size_t>(number));
  return pixels;
}

inline Frame frame(int number, const std::vector<std::uint8_t>& pixels) {
  Frame frame;
  frame.image = {pixels.data(), kWidth, kHeight, kWidth};
  frame.capture_time = at_ms(1000 + 40 * number);
  frame.latency_origin = frame.capture_time;
  frame.sequence = static_cast<std::uint64_t>(number);
  return frame;
}

inline RawFrame grey(const std::vector<std::uint8_t>& pixels) {
  return {fourcc("GREY"), pixels, kWidth};
}

inline Track track(int number) {
  Track track;
  track.status = Status::ok;
  track.displacement << 1e-6 * number, -2e-6, 3e-6, 1e-3, -2e-3, 1.0 / 3;
  track.covariance.setIdentity();
  track.covariance(0, 5) = track.covariance(5, 0) = 0.125;
  track.residual_px = 0.25;
  track.tags_held = 2;
  track.corner_count = 2;
  track.corners[0].id = 5;
  track.corners[1].id = 2;
  for (std::size_t i = 0; i < 8; ++i) track.corners[1].px[i] = 10.5 + static_cast<double>(i);
  return track;
}

inline Sample sample(const Frame& frame) {
  Sample sample;
  sample.sequence = frame.sequence;
  sample.capture_time = frame.capture_time;
  sample.latency_origin = frame.latency_origin;
  sample.output_time = frame.latency_origin + std::chrono::microseconds(812);
  sample.status = Status::ok;
  sample.wrench << 0.1, -0.2, 1.0 / 3, 0.001, 0.002, -0.003;
  return sample;
}

/// Frame, track and sample of so many frames.
inline void write_frames(RecordingWriter& writer, int from, int to) {
  for (int i = from; i < to; ++i) {
    const auto pixels = picture(i);
    const Frame f = frame(i, pixels);
    writer.frame(f, f.readable(), grey(pixels));
    writer.track(track(i));
    writer.sample(sample(f));
  }
}

inline void write_recording(const std::filesystem::path& path, int frames, Keep keep = Keep::raw) {
  RecordingWriter writer({.path = path, .lossless = true}, head(keep));
  write_frames(writer, 0, frames);
  writer.reference({.time = at_ms(1010), .channel = 1, .counts = {100}, .value = {0.5}});
  writer.event(EventKind::note, at_ms(1020), "a note");
  writer.mark(0, true, at_ms(1020));
  writer.mark(0, false, at_ms(1060));
  ASSERT_EQ(writer.finish(), "");
}

/// What it was refused with; empty if it was not.
template <class Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

}  // namespace tagwrench::record::test
