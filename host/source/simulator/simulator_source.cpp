#include "host/source/simulator/simulator_source.h"

#include <fmt/format.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench {
namespace {

constexpr double kWarmUp = 0.05;     // s, simulated before the first frame
constexpr double kMin = 50e-6;       // s, exposure that can be set
constexpr double kMaxJitters = 8.0;  // more than the mean delay; keeps the stamps in order
constexpr int kExposureSteps = 16;

const sim::Scenario& checked(const sim::Scenario& scenario) {
  const std::string problem = sim::problem(scenario);
  if (!problem.empty()) throw ConfigError("scenario: " + problem);
  return scenario;
}

std::unique_ptr<sim::AppliedLoad> person_at_desk(const sim::Scenario& scenario) {
  if (scenario.trajectory.motion != sim::Motion::desk) return nullptr;
  return std::make_unique<sim::DeskUse>(scenario);
}

Duration to_duration(double seconds) { return Duration(std::llround(1e9 * seconds)); }

/// Seconds before and after the middle of a frame that the longest exposure reaches.
double longest_half_window(const sim::Scenario& scenario) {
  return 0.5 * sim::true_period(scenario);
}

timespec to_timespec(Duration since_boot) {
  const auto ns = since_boot.count();
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

UniqueFd make_timer() {
  UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (!timer) {
    throw ConfigError(
        "simulated sensor: no timer from the kernel ({}): close other programs and try again",
        std::strerror(errno));
  }
  return timer;
}

}  // namespace

SimulatorSource::SimulatorSource(const sim::Scenario& scenario, bool live, sim::LedLight* led,
                                 sim::AppliedLoad* load)
    : scenario_(checked(scenario)),
      disturbances_(scenario.disturbances, scenario.seed, scenario.camera.width_px,
                    static_cast<int>(scenario.target.tags.size())),
      desk_(load == nullptr ? person_at_desk(scenario) : nullptr),
      load_(desk_ ? desk_.get() : load),
      renderer_(scenario),
      motion_(scenario.mechanics, sim::TrajectoryPlayer(scenario.trajectory, scenario.seed),
              -renderer_.half_window() - kWarmUp,
              2 * longest_half_window(scenario) + 4 * sim::PlatformMotion::kStep, load_),
      jpeg_(scenario.camera.width_px, scenario.camera.height_px, scenario.compression.jpeg_quality),
      pixels_(static_cast<std::size_t>(scenario.camera.width_px) *
              static_cast<std::size_t>(scenario.camera.height_px)) {
  const sim::Camera& camera = scenario_.camera;
  format_.width = camera.width_px;
  format_.height = camera.height_px;
  format_.period = to_duration(1 / camera.frame_rate);
  period_ = to_duration(sim::true_period(scenario_));
  format_.description = fmt::format("simulated sensor, {}x{} at {:g} Hz, {} {}", camera.width_px,
                                    camera.height_px, camera.frame_rate, scenario_.target.family,
                                    scenario_.target.tags.size() == 1 ? "tag" : "tags");
  truth_.tags = renderer_.tags();
  truth_.visible = renderer_.visible();
  truth_.rest_position = scenario_.target.rest_position;
  renderer_.set_led(led);
  if (live) {
    timer_ = make_timer();
    start_ = std::chrono::steady_clock::now() + period_;
    arm();
  }
}

/// The time stamp of a frame: the middle of its exposure, and what driver and cable add.
TimePoint SimulatorSource::delivery_time(std::uint64_t sequence) const noexcept {
  const TimePoint exposed = start_ + period_ * static_cast<std::int64_t>(sequence);
  const sim::Delivery& delivery = scenario_.delivery;
  if (delivery.latency <= 0) return exposed;
  sim::Random random = sim::Random::numbered(scenario_.seed, sim::kDeliveryJitter, sequence);
  const double exponential = std::min(-std::log(1 - random.uniform()), kMaxJitters);
  return exposed + to_duration(delivery.latency + delivery.jitter * (exponential - 1));
}

/// The newest frame from next_sequence_ on that was delivered by `now`; next_sequence_ itself if
/// none was.
std::uint64_t SimulatorSource::newest_delivered(TimePoint now) const noexcept {
  const auto delay = to_duration(scenario_.delivery.latency);
  const auto periods = (now - start_ - delay) / period_;
  // Jitter moves a stamp by less than a period.
  auto newest =
      std::max(next_sequence_, static_cast<std::uint64_t>(std::max<std::int64_t>(0, periods + 1)));
  while (newest > next_sequence_ && delivery_time(newest) > now) --newest;
  return newest;
}

/// Wakes the reader when the next frame is delivered.
void SimulatorSource::arm() const noexcept {
  itimerspec when{};
  when.it_value = to_timespec(delivery_time(next_sequence_).time_since_epoch());
  ::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &when, nullptr);
}

/// The first frame has nothing before it.
bool SimulatorSource::stale(std::uint64_t sequence) const noexcept {
  if (!rendered_ || scenario_.delivery.stale_share <= 0) return false;
  sim::Random random = sim::Random::numbered(scenario_.seed, sim::kStaleFrames, sequence);
  return random.uniform() < scenario_.delivery.stale_share;
}

CameraLight::Range SimulatorSource::exposure_range_us() const noexcept {
  const double longest = sim::true_period(scenario_) - scenario_.exposure.rolling_readout;
  return {kMin * 1e6, std::max(kMin, longest) * 1e6};
}

bool SimulatorSource::set_exposure_us(double exposure_us) noexcept {
  const Range range = exposure_range_us();
  if (!std::isfinite(exposure_us)) return false;
  renderer_.set_exposure(std::clamp(exposure_us, range.least, range.most) * 1e-6,
                         renderer_.sensor_gain());
  return true;
}

bool SimulatorSource::set_gain(double gain) noexcept {
  if (!std::isfinite(gain)) return false;
  renderer_.set_exposure(renderer_.exposure(), std::clamp(gain, 1.0, kMaxGain));
  return true;
}

ReadStatus SimulatorSource::read(Frame& frame) noexcept {
  std::uint64_t sequence = next_sequence_;
  if (timer_) {
    std::uint64_t ticks = 0;
    if (::read(timer_.get(), &ticks, sizeof ticks) != sizeof ticks) return ReadStatus::nothing;
    sequence = newest_delivered(std::chrono::steady_clock::now());
    lost_ += static_cast<std::uint32_t>(sequence - next_sequence_);
  }
  bool lost = false;
  while ((lost = disturbances_.frame_lost(sequence))) {
    ++lost_;
    ++sequence;
    if (timer_) break;
  }
  next_sequence_ = lost ? sequence : sequence + 1;
  if (timer_) arm();
  if (lost) return ReadStatus::nothing;
  render(sequence);

  frame.image = {pixels_.data(), format_.width, format_.height, format_.width};
  frame.decoded = {};
  frame.sequence = sequence;
  frame.dropped = std::exchange(lost_, 0);
  frame.capture_time = delivery_time(sequence);
  frame.latency_origin = timer_ ? frame.capture_time : std::chrono::steady_clock::now();
  return ReadStatus::frame;
}

void SimulatorSource::let_tags_slip(double time) noexcept {
  for (std::size_t tag = 0; tag < truth_.tags.size(); ++tag) {
    renderer_.slip_tag(tag, load_->slip(static_cast<int>(tag), time));
    truth_.tags[tag] = renderer_.tags()[tag];
  }
}

void SimulatorSource::render(std::uint64_t sequence) noexcept {
  truth_.sequence = sequence;
  truth_.stale = stale(sequence);
  if (truth_.stale) return;
  truth_.time = period_ * static_cast<std::int64_t>(sequence);
  const double time = std::chrono::duration<double>(truth_.time).count();
  if (load_) let_tags_slip(time);
  motion_.advance_to(time + renderer_.half_window());
  renderer_.render(motion_, time, sequence, pixels_.data());
  rendered_ = true;
  jpeg_.apply(pixels_.data());
  truth_.displacement = motion_.seen(time);
  truth_.exposed_displacement.setZero();
  for (int i = 0; i < kExposureSteps; ++i) {
    const double share = (i + 0.5) / kExposureSteps - 0.5;
    truth_.exposed_displacement +=
        motion_.seen(time + share * renderer_.exposure()) / kExposureSteps;
  }
  truth_.wrench = motion_.applied_wrench(time);
  truth_.camera_T_platform = sim::platform_pose(scenario_.target, truth_.displacement);
  truth_.disturbances = renderer_.happening().kinds;
  std::copy(renderer_.visible().begin(), renderer_.visible().end(), truth_.visible.begin());
  truth_.smear_px = renderer_.smear_px();
}

}  // namespace tagwrench
