#include "host/tools/camera_timing/board_pattern_lamp.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace tagwrench {
namespace {

// After the latest exchange of times, which may be a tenth of a second ago: the order arrives
// first.
constexpr Duration kStartAhead = std::chrono::milliseconds(400);
constexpr std::uint32_t kSpan_us = 10'000'000;  // over which the rate of the clocks is asked for

}  // namespace

BoardPatternLamp::BoardPatternLamp(link::BoardSession& session, std::function<void()> pump,
                                   int poll_fd)
    : session_(session),
      pump_(std::move(pump)),
      poll_fd_(poll_fd),
      restarts_(session.counters().restarts) {}

void BoardPatternLamp::order(const link::Led& led) {
  led_ = led;
  session_.set_led(led);
  pump_();
}

void BoardPatternLamp::off() { order({}); }

void BoardPatternLamp::steady(int level_permille) {
  link::Led led{};
  led.mode = link::LedMode::steady;
  led.level_permille = static_cast<std::uint16_t>(std::clamp(level_permille, 0, 1000));
  order(led);
}

void BoardPatternLamp::pattern(Duration bit, std::uint16_t seed) {
  link::Led led{};
  led.mode = link::LedMode::pattern;
  led.period_us = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(bit).count());
  led.start_us = session_.clock().to_board(session_.clock().latest() + kStartAhead);
  led.pattern_seed = seed;
  order(led);
}

/// Of the latest estimate of the clocks, at the middle of the time since the start.
std::optional<PatternTiming> BoardPatternLamp::timing() const {
  const link::ClockSync& clock = session_.clock();
  if (led_.mode != link::LedMode::pattern || !clock.known()) return std::nullopt;
  const link::HostTime first = clock.to_host(led_.start_us);
  const link::HostTime later = clock.to_host(led_.start_us + kSpan_us);
  const Duration since = clock.latest() - first.time;
  const link::HostTime middle = clock.to_host(clock.to_board(first.time + since / 2));
  PatternTiming timing;
  timing.start = first.time;
  timing.period = std::chrono::duration<double>(later.time - first.time).count() / kSpan_us *
                  static_cast<double>(led_.period_us);
  timing.start_sigma = std::chrono::duration<double>(middle.sigma).count();
  timing.rate_sigma = 1e-6 * clock.report().skew_sigma_ppm;
  timing.seed = led_.pattern_seed;
  return timing;
}

void BoardPatternLamp::service() noexcept {
  try {
    pump_();
    if (session_.state() != link::BoardState::ready || session_.counters().restarts != restarts_) {
      trouble_ = "the board was unplugged or started anew: plug it in and start again";
    }
    for (link::FaultReading fault; session_.next(fault);) {
      if (fault.code == link::FaultCode::led_limited)
        trouble_ = "the board dimmed its LED, which had become too warm: wait half a minute";
      if (fault.code == link::FaultCode::host_silent)
        trouble_ = "the board heard nothing for too long and switched its LED off: start again";
    }
  } catch (const std::exception&) {
    trouble_.clear();  // out of memory: unsaid
  }
}

Duration BoardPatternLamp::shortest_bit() const noexcept {
  if (!session_.has_capabilities()) return PatternLamp::shortest_bit();
  return std::max<Duration>(
      PatternLamp::shortest_bit(),
      std::chrono::microseconds(session_.capabilities().strobe_period_min_us));
}

}  // namespace tagwrench
