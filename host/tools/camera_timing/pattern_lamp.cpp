#include <algorithm>
#include <utility>

#include "host/tools/camera_timing/measurement.h"
#include "protocol/pattern.h"

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
  return PatternTiming{.start = first.time,
                       .period = std::chrono::duration<double>(later.time - first.time).count() /
                                 kSpan_us * static_cast<double>(led_.period_us),
                       .start_sigma = std::chrono::duration<double>(middle.sigma).count(),
                       .rate_sigma = 1e-6 * clock.report().skew_sigma_ppm,
                       .seed = led_.pattern_seed};
}

void BoardPatternLamp::service() noexcept {
  pump_();
  if (session_.state() != link::BoardState::ready || session_.counters().restarts != restarts_)
    trouble_ = "the board was unplugged or started anew: plug it in and start again";
  for (link::FaultReading fault; session_.next(fault);) {
    if (fault.code == link::FaultCode::led_limited)
      trouble_ = "the board dimmed its LED, which had become too warm: wait half a minute";
    if (fault.code == link::FaultCode::host_silent)
      trouble_ = "the board heard nothing for too long and switched its LED off: start again";
  }
}

Duration BoardPatternLamp::shortest_bit() const noexcept {
  if (!session_.has_capabilities()) return PatternLamp::shortest_bit();
  return std::max<Duration>(
      PatternLamp::shortest_bit(),
      std::chrono::microseconds(session_.capabilities().strobe_period_min_us));
}

/// When an order can be carried out at the earliest, simulation time, s.
double SimulatedLamp::now() const noexcept {
  const std::chrono::duration<double> now = std::chrono::steady_clock::now() - zero_;
  return live_ ? std::max(now.count(), 0.0) : seen_;
}

void SimulatedLamp::begin(Order order) {
  order.since = std::max(order.since, now());
  orders_.push_back(order);
}

void SimulatedLamp::show(bool white, TimePoint when) {
  const std::chrono::duration<double> since = when - zero_;
  begin({.since = since.count(), .kind = Kind::steady, .level = white ? 1.0 : 0.0});
}

void SimulatedLamp::pattern(Duration bit, std::uint16_t seed) {
  bits_.clear();
  std::uint16_t state = seed;
  for (std::uint16_t i = 0; i < link::kPatternBits; ++i) {
    bits_.push_back(link::pattern_light(state));
    state = link::next_pattern_state(state);
  }
  begin({.kind = Kind::pattern, .bit = std::chrono::duration<double>(bit).count(), .seed = seed});
}

std::optional<PatternTiming> SimulatedLamp::timing() const {
  if (orders_.empty() || orders_.back().kind != Kind::pattern) return std::nullopt;
  const Order& order = orders_.back();
  return PatternTiming{.start = time_of(order), .period = order.bit, .seed = order.seed};
}

/// Seconds of light from `from` to `to`, both under this order.
double SimulatedLamp::on_time(const Order& order, double from, double to) const noexcept {
  if (order.kind == Kind::steady) return order.level * (to - from);
  double on = 0;
  for (double at = from; at < to;) {
    const double k = std::floor((at - order.since) / order.bit + 1e-9);
    const double until = std::min(to, order.since + (k + 1) * order.bit);
    const auto bit = static_cast<std::size_t>(std::max(k, 0.0)) % bits_.size();
    if (bits_[bit]) on += until - at;
    at = until;
  }
  return on;
}

double SimulatedLamp::mean(double from, double to) noexcept {
  seen_ = std::max(seen_, to);
  const double length = std::max(to - from, 1e-9);
  double on = 0;
  for (std::size_t i = 0; i < orders_.size(); ++i) {
    const double end = i + 1 < orders_.size() ? orders_[i + 1].since : from + length;
    const double begin = std::max(from, orders_[i].since);
    const double until = std::min(from + length, end);
    if (until > begin) on += on_time(orders_[i], begin, until);
  }
  return on / length;
}

}  // namespace tagwrench
