// A played clip, outputs that remember, and the pipeline between them.
#pragma once

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <functional>

#include "host/app/pipeline.h"
#include "host/core/os/unique_fd.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench::test {

inline constexpr int kRestFrames = 5;
inline constexpr int kFrames = 12;

/// A push along z, small and short, rendered once for all tests here.
struct Clip {
  SensorConfig sensor;
  std::vector<std::vector<std::uint8_t>> pictures;

  Clip() {
    sim::Scenario scenario;
    scenario.trajectory.motion = sim::Motion::push;
    scenario.trajectory.axis = 2;
    scenario.trajectory.rest_time = kRestFrames / scenario.camera.frame_rate;
    sensor = parse_sensor(sim::sensor_yaml(scenario), "the test's sensor");
    sensor.rest.frames = kRestFrames;
    SimulatorSource source(scenario, /*live=*/false);
    for (int i = 0; i < kFrames; ++i) {
      Frame frame;
      source.read(frame);
      pictures.emplace_back(frame.image.pixels,
                            frame.image.pixels + frame.image.stride * frame.image.height);
    }
  }
  static const Clip& get() {
    static const Clip clip;
    return clip;
  }
};

/// Plays the clip, repeating its last picture, then does `after`.
class PlayedSource final : public FrameSource {
 public:
  enum class After : std::uint8_t { end, silence, disconnect };

  PlayedSource(int frames, After after)
      : frames_(frames), after_(after), ready_(::eventfd(1, EFD_NONBLOCK)) {
    format_ = {640, 480, std::chrono::milliseconds(40), "played"};
  }
  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return ready_.get(); }
  ReadStatus read(Frame& frame) noexcept override {
    if (next_ < frames_) {
      const auto& pixels =
          Clip::get().pictures[static_cast<std::size_t>(std::min(next_, kFrames - 1))];
      frame = {};
      frame.image = {pixels.data(), 640, 480, 640};
      frame.latency_origin = std::chrono::steady_clock::now();
      frame.capture_time = TimePoint{} + next_ * format_.period;
      frame.sequence = static_cast<std::uint64_t>(next_++);
      return ReadStatus::frame;
    }
    if (after_ == After::end) return ReadStatus::end;
    std::uint64_t drained = 0;
    if (::read(ready_.get(), &drained, sizeof drained) < 0) return ReadStatus::nothing;
    return after_ == After::disconnect ? ReadStatus::disconnected : ReadStatus::nothing;
  }
  std::string detail() const override { return "the camera went away"; }

 private:
  int frames_;
  After after_;
  UniqueFd ready_;
  SourceFormat format_;
  int next_ = 0;
};

/// Remembers what it was sent; `on_send` may stop the run or fail.
class Recorder final : public Output {
 public:
  explicit Recorder(std::function<SendStatus(const Sample&)> on_send = {})
      : on_send_(std::move(on_send)) {
    samples.reserve(4096);
    moves.reserve(4096);
  }
  SendStatus send(const Sample& sample) noexcept override {
    samples.push_back(sample);
    return on_send_ ? on_send_(sample) : SendStatus::ok;
  }
  SendStatus move(const Sample& sample) noexcept override {
    moves.push_back(sample);
    if (on_move) on_move(sample);
    return SendStatus::ok;
  }
  std::string failure() const override { return "recorder: broken on purpose"; }
  bool notice(std::string_view line) noexcept override {
    notices.emplace_back(line);
    return true;
  }

  std::vector<Sample> samples;
  std::vector<Sample> moves;  ///< what an input device would show
  std::function<void(const Sample&)> on_move;
  std::vector<std::string> notices;

 private:
  std::function<SendStatus(const Sample&)> on_send_;
};

class PipelineLoop : public testing::Test {
 protected:
  RunReport run(FrameSource& source, std::unique_ptr<Recorder> recorder,
                const RunLimits& limits = {}) {
    outputs_.push_back(std::move(recorder));
    Tracker tracker(sensor_.camera, sensor_.target, sensor_.rest);
    WrenchEstimator wrench(sensor_.wrench);
    ProfileManager desk(default_profile(sensor_));
    Watchdog watchdog({});
    return Pipeline(source, tracker, wrench, desk, fed(), watchdog, stop_.get()).run(limits);
  }
  std::vector<Output*> fed() const {
    std::vector<Output*> all;
    for (const std::unique_ptr<Output>& output : outputs_) all.push_back(output.get());
    return all;
  }
  const Recorder& recorder() const { return static_cast<const Recorder&>(*outputs_.back()); }

  SensorConfig sensor_ = Clip::get().sensor;
  std::vector<std::unique_ptr<Output>> outputs_;
  UniqueFd stop_{::eventfd(0, EFD_NONBLOCK)};
};

}  // namespace tagwrench::test
