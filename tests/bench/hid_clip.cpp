#include "tests/bench/hid_clip.h"

#include <sys/timerfd.h>

#include <cmath>
#include <ctime>

#include "host/source/simulator/simulator_source.h"

namespace tagwrench::bench {
namespace {

double thread_cpu() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

HidClip::HidClip(const sim::Scenario& scenario, double seconds)
    : fps(scenario.camera.frame_rate),
      sensor(parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor")) {
  SimulatorSource source(scenario, /*live=*/false);
  const auto count = static_cast<std::size_t>(std::lround(seconds * fps));
  while (pictures.size() < count) {
    Frame frame;
    source.read(frame);
    const ImageView& image = frame.image;
    pictures.emplace_back(image.pixels, image.pixels + image.stride * image.height);
  }
}

ClipSource::ClipSource(const HidClip& clip, std::vector<int> script, std::size_t warm)
    : clip_(clip),
      script_(std::move(script)),
      warm_(warm),
      format_{clip.sensor.camera.width_px, clip.sensor.camera.height_px,
              Duration(std::llround(1e9 / clip.fps)), "pictures out of memory"},
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
  start_ = std::chrono::steady_clock::now() + format_.period;
  arm();
}

TimePoint ClipSource::due(std::size_t index) const noexcept {
  return start_ + static_cast<std::int64_t>(index) * format_.period;
}

void ClipSource::arm() const noexcept {
  const auto ns = due(next_).time_since_epoch().count();
  const itimerspec when{{0, 0}, {ns / 1'000'000'000, ns % 1'000'000'000}};
  ::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &when, nullptr);
}

ReadStatus ClipSource::read(Frame& frame) noexcept {
  const TimePoint now = std::chrono::steady_clock::now();
  if (next_ >= script_.size()) return ReadStatus::end;
  if (now < due(next_)) return ReadStatus::nothing;
  while (next_ + 1 < script_.size() && now >= due(next_ + 1)) ++next_;
  if (delivered_ <= warm_) {
    warm_cpu_ = thread_cpu();
    warm_time_ = now;
  }
  end_cpu_ = thread_cpu();
  end_time_ = now;
  frame = {};
  const auto& pixels = clip_.pictures[static_cast<std::size_t>(script_[next_])];
  frame.image = {pixels.data(), format_.width, format_.height, format_.width};
  frame.capture_time = frame.latency_origin = due(next_);
  frame.sequence = next_;
  frame.dropped = static_cast<std::uint32_t>(next_ - delivered_);
  delivered_ = ++next_;
  arm();
  return ReadStatus::frame;
}

double ClipSource::cpu_share() const {
  return (end_cpu_ - warm_cpu_) / std::chrono::duration<double>(end_time_ - warm_time_).count();
}

}  // namespace tagwrench::bench
