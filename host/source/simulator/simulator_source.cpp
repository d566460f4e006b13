#include "host/source/simulator/simulator_source.h"

#include <fmt/format.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr double kWarmUp = 0.05;  // s, simulated before the first frame
constexpr int kExposureSteps = 16;

const sim::Scenario& checked(const sim::Scenario& scenario) {
  const std::string problem = sim::problem(scenario);
  if (!problem.empty()) throw ConfigError("scenario: " + problem);
  return scenario;
}

Duration frame_period(const sim::Camera& camera) {
  return Duration(std::llround(1e9 / camera.frame_rate));
}

timespec to_timespec(Duration since_boot) {
  const auto ns = since_boot.count();
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

UniqueFd start_timer(TimePoint start, Duration period) {
  UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  itimerspec when{};
  when.it_value = to_timespec((start + period).time_since_epoch());
  when.it_interval = to_timespec(period);
  if (!timer || ::timerfd_settime(timer.get(), TFD_TIMER_ABSTIME, &when, nullptr) != 0) {
    throw ConfigError(fmt::format(
        "simulated sensor: no timer from the kernel ({}): close other programs and try again",
        std::strerror(errno)));
  }
  return timer;
}

}  // namespace

SimulatorSource::SimulatorSource(const sim::Scenario& scenario, bool live)
    : scenario_(checked(scenario)),
      disturbances_(scenario.disturbances, scenario.seed, scenario.camera.width_px,
                    static_cast<int>(scenario.target.tags.size())),
      player_(scenario.trajectory, scenario.seed),
      renderer_(scenario),
      motion_(scenario.mechanics, player_, -renderer_.half_window() - kWarmUp,
              2 * renderer_.half_window() + 4 * sim::PlatformMotion::kStep),
      jpeg_(scenario.camera.width_px, scenario.camera.height_px, scenario.compression.jpeg_quality),
      pixels_(static_cast<std::size_t>(scenario.camera.width_px) *
              static_cast<std::size_t>(scenario.camera.height_px)) {
  const sim::Camera& camera = scenario_.camera;
  format_.width = camera.width_px;
  format_.height = camera.height_px;
  format_.period = frame_period(camera);
  format_.description = fmt::format("simulated sensor, {}x{} at {:g} Hz, {} {}", camera.width_px,
                                    camera.height_px, camera.frame_rate, scenario_.target.family,
                                    scenario_.target.tags.size() == 1 ? "tag" : "tags");
  truth_.tags = renderer_.tags();
  truth_.visible = renderer_.visible();
  truth_.rest_position = scenario_.target.rest_position;
  if (live) {
    start_ = std::chrono::steady_clock::now();
    timer_ = start_timer(start_, format_.period);
  }
}

ReadStatus SimulatorSource::read(Frame& frame) noexcept {
  std::uint64_t ticks = 1;
  if (timer_ && ::read(timer_.get(), &ticks, sizeof ticks) != sizeof ticks)
    return ReadStatus::nothing;
  if (ticks == 0) return ReadStatus::nothing;
  std::uint64_t sequence = next_sequence_ + ticks - 1;
  lost_ += static_cast<std::uint32_t>(ticks - 1);
  while (disturbances_.frame_lost(sequence)) {
    ++lost_;
    ++sequence;
    if (timer_) {
      next_sequence_ = sequence;
      return ReadStatus::nothing;
    }
  }
  next_sequence_ = sequence + 1;
  render(sequence);

  frame.image = {pixels_.data(), format_.width, format_.height, format_.width};
  frame.decoded = {};
  frame.sequence = sequence;
  frame.dropped = std::exchange(lost_, 0);
  // The first tick came one period after the start.
  frame.capture_time = timer_ ? start_ + format_.period + truth_.time : TimePoint(truth_.time);
  frame.latency_origin = timer_ ? frame.capture_time : std::chrono::steady_clock::now();
  return ReadStatus::frame;
}

void SimulatorSource::render(std::uint64_t sequence) noexcept {
  truth_.sequence = sequence;
  truth_.time = format_.period * static_cast<std::int64_t>(sequence);
  const double time = std::chrono::duration<double>(truth_.time).count();
  motion_.advance_to(time + renderer_.half_window());
  renderer_.render(motion_, time, sequence, pixels_.data());
  jpeg_.apply(pixels_.data());
  truth_.displacement = motion_.at(time).displacement;
  truth_.exposed_displacement.setZero();
  for (int i = 0; i < kExposureSteps; ++i) {
    const double share = (i + 0.5) / kExposureSteps - 0.5;
    truth_.exposed_displacement +=
        motion_.at(time + share * scenario_.exposure.time).displacement / kExposureSteps;
  }
  truth_.wrench = player_.applied_wrench(time);
  truth_.camera_T_platform = sim::platform_pose(scenario_.target, truth_.displacement);
  truth_.disturbances = renderer_.happening().kinds;
  std::copy(renderer_.visible().begin(), renderer_.visible().end(), truth_.visible.begin());
  truth_.smear_px = renderer_.smear_px();
}

}  // namespace tagwrench
