#include "host/tools/camera_timing/simulated_lamp.h"

#include <algorithm>
#include <cmath>

#include "protocol/pattern.h"

namespace tagwrench {

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

std::optional<TimePoint> SimulatedLamp::shown() {
  return zero_ + Duration(std::llround(1e9 * orders_.back().since));
}

void SimulatedLamp::steady(int level_permille) {
  begin({.kind = Kind::steady, .level = 1e-3 * level_permille});
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
  PatternTiming timing;
  timing.start = zero_ + Duration(std::llround(1e9 * order.since));
  timing.period = order.bit;
  timing.seed = order.seed;
  return timing;
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
