#include "host/board/clock_sync.h"

namespace tagwrench::link {
namespace {

constexpr double kMinRoundTrip = -2e-3;  ///< below zero only where wire times are not as told
constexpr double kMaxRoundTrip = 1;
constexpr double kGate = 25;               ///< squared innovation over its variance: 5 sigma
constexpr std::size_t kContradicting = 8;  ///< in a row: it was not they that erred
constexpr double kOneSidedSigma = 0.29;    ///< k is within +-1/2
constexpr double kScaleWeight = 20;        ///< exchanges that the assumed scale of errors is worth
constexpr double kMinVariance = 1e-13;     ///< s^2: the board's times are whole microseconds

std::int64_t to_ns(TimePoint time) {
  return std::chrono::duration_cast<Duration>(time.time_since_epoch()).count();
}
Duration to_duration(double seconds) {
  return Duration(std::llround(std::clamp(seconds, -1e9, 1e9) * 1e9));
}
double squared(double x) { return x * x; }

constexpr double kFirstJitter = 5e-3;  ///< s, before any is seen
constexpr double kMinJitter = 20e-6;   ///< s
constexpr double kPeriodSigma = 0.02;  ///< of the nominal period
constexpr double kWander = 1e-6;       ///< of the period, relative, per square root of a second
constexpr double kForget = 0.02;       ///< of the jitter's estimate, per sample
constexpr double kCounterGate = 36;    ///< squared innovation over its variance
constexpr double kMisfitTime = 0.5;    ///< s
constexpr double kMaxSteps = 30'000;   ///< half of the counter's range: a bridge of a long silence

}  // namespace

void ClockSync::restart() noexcept {
  first_ = count_ = 0;
  state_ = {};
  accepted_ = rejected_ = 0;
  least_ = {};
  misfit_ = {};
  unsteady_ = 0;
  out_of_order_ = 0;
}

std::int64_t ClockSync::unwrap(std::uint32_t board_us, std::int64_t near_us) const noexcept {
  const auto difference = static_cast<std::int32_t>(board_us - static_cast<std::uint32_t>(near_us));
  return near_us + difference;
}

bool ClockSync::add(const TimeExchange& exchange) noexcept {
  const double wire_request = exchange.request_bytes * options_.request_byte_us * 1e-6;
  const double wire_reply = exchange.reply_bytes * options_.reply_byte_us * 1e-6;
  const std::int64_t sent_ns = to_ns(exchange.host_sent) + std::llround(wire_request * 1e9);
  const std::int64_t received_ns = to_ns(exchange.host_received) - std::llround(wire_reply * 1e9);

  Entry entry;
  entry.host_ns = sent_ns + (received_ns - sent_ns) / 2;
  entry.host_span = static_cast<double>(received_ns - sent_ns) * 1e-9;
  entry.board_span =
      static_cast<std::int32_t>(exchange.board_sent_us - exchange.board_received_us) * 1e-6;
  // The host's clock bridges silences longer than a wrap.
  const std::int64_t elapsed_us = count_ == 0 ? 0 : (sent_ns - to_ns(host_reference_)) / 1000;
  const std::int64_t near_us = count_ == 0 ? std::int64_t{exchange.board_received_us}
                                           : board_reference_us2_ / 2 + elapsed_us;
  const std::int64_t board_received = unwrap(exchange.board_received_us, near_us);
  entry.board_us2 = 2 * board_received + std::llround(entry.board_span * 1e6);

  const double trip = round_trip(entry);
  const bool possible = entry.board_span >= 0 && trip >= kMinRoundTrip && trip <= kMaxRoundTrip;
  const bool forward = count_ == 0 || (exchange.host_sent >= last_sent_ &&
                                       entry.board_us2 > this->entry(count_ - 1).board_us2);
  if (!possible || (!forward && !begins_anew(entry))) {
    ++rejected_;
    return false;
  }
  out_of_order_ = 0;
  last_sent_ = exchange.host_sent;
  append(entry);
  refit();
  ++(misfit_.size == 0 ? accepted_ : rejected_);
  return misfit_.size == 0;
}

/// Of a clock that stands still or goes back: true, and all others forgotten, when it has done so
/// for long. Until then it widens the sigma.
bool ClockSync::begins_anew(const Entry& late) noexcept {
  const double since = static_cast<double>(late.board_us2 - board_reference_us2_) * 0.5e-6;
  const double innovation = offset(late) - state_.mean[0] - state_.mean[1] * since;
  misfit_.size = std::max(misfit_.size, std::abs(innovation));
  if (++out_of_order_ < kContradicting) return false;
  note_jump(misfit_.size, late.host_ns);
  first_ = count_ = 0;
  state_ = {};
  return true;
}

void ClockSync::refit() noexcept {
  least_ = least_round_trip();
  const Pass assumed = pass(1);
  const double scale =
      (assumed.surprise + kScaleWeight) / (static_cast<double>(assumed.fitting) + kScaleWeight);
  const Pass fitted = pass(std::clamp(scale, 1.0, 9.0));
  state_ = fitted.state;
  misfit_ = fitted.misfit;
  const std::int64_t now_ns = entry(count_ - 1).host_ns;
  if (fitted.begin > 0) {
    drop_oldest(fitted.begin);
    note_jump(fitted.jump, now_ns);
  } else if (std::abs(now_ns - last_jump_ns_) > kWindow.count()) {
    unsteady_ = 0;
  }
}

void ClockSync::append(const Entry& entry) noexcept {
  while (count_ > 0 && entry.host_ns - this->entry(0).host_ns > kWindow.count()) drop_oldest(1);
  if (count_ == kMaxEntries) drop_oldest(1);
  entries_[(first_ + count_) % kMaxEntries] = entry;
  ++count_;
  board_reference_us2_ = entry.board_us2;
  host_reference_ = TimePoint(Duration(entry.host_ns));
}

/// The fastest round trip of all that might be. The n-th fastest sum of two delays exceeds the
/// bound by about sqrt(n) times a constant; so the fourth exceeds the first by as much as the first
/// exceeds the bound, and the sixteenth by three times that. Of few exchanges nothing is known:
/// zero.
ClockSync::RoundTrip ClockSync::least_round_trip() const noexcept {
  std::array<double, 16> fastest;
  fastest.fill(kMaxRoundTrip);
  for (std::size_t i = 0; i < count_; ++i) {
    double trip = round_trip(entry(i));
    if (trip >= fastest.back()) continue;
    for (double& place : fastest)
      if (trip < place) std::swap(trip, place);
  }
  const double beyond_zero = std::max(-fastest[0], 0.0);
  if (count_ < kFewForRoundTrip) return {0, 0, beyond_zero};
  double excess = fastest[3] - fastest[0];
  if (count_ >= 4 * fastest.size()) excess = std::max(excess, (fastest[15] - fastest[0]) / 3);
  const double bound = fastest[0] - excess;
  return {fastest[0] > 0 ? std::max(bound, 0.0) : bound, excess, beyond_zero};
}

/// Host minus board time, both since the reference.
double ClockSync::offset(const Entry& entry) const noexcept {
  const double host = static_cast<double>(entry.host_ns - to_ns(host_reference_)) * 1e-9;
  const double board = static_cast<double>(entry.board_us2 - board_reference_us2_) * 0.5e-6;
  return host - board;
}

void ClockSync::start(State& state, const Entry& entry, double excess) const noexcept {
  state.mean << offset(entry), 0, 0;
  state.covariance.setZero();
  // The first measurement is the prior of the offset: correlated with k as a measurement is.
  const double k_variance = squared(kOneSidedSigma);
  state.covariance(0, 0) =
      squared(options_.stamp_sigma_us * 1e-6) + squared(excess) / 12 + squared(excess) * k_variance;
  state.covariance(0, 2) = state.covariance(2, 0) = -excess * k_variance;
  state.covariance(1, 1) = squared(options_.skew_sigma_ppm * 1e-6);
  state.covariance(2, 2) = k_variance;
}

void ClockSync::predict(State& state, double seconds) const noexcept {
  Eigen::Matrix3d step = Eigen::Matrix3d::Identity();
  step(0, 1) = seconds;
  state.mean = step * state.mean;
  state.covariance = (step * state.covariance * step.transpose()).eval();
  const double q = squared(options_.wander_ppm * 1e-6);
  state.covariance(0, 0) += q * seconds * seconds * seconds / 3;
  state.covariance(0, 1) += q * seconds * seconds / 2;
  state.covariance(1, 0) += q * seconds * seconds / 2;
  state.covariance(1, 1) += q * seconds;
}

ClockSync::Pass ClockSync::pass(double scale) const noexcept {
  Pass out;
  std::size_t contradicting = 0;
  std::int64_t fitting_us2 = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Entry& now = entry(i);
    const double excess = this->excess(now);
    if (i == 0) {
      start(out.state, now, excess);
      fitting_us2 = now.board_us2;
      continue;
    }
    predict(out.state, static_cast<double>(now.board_us2 - entry(i - 1).board_us2) * 0.5e-6);
    const Eigen::RowVector3d seen(1, 0, excess);
    const double noise = squared(options_.stamp_sigma_us * 1e-6) + scale * squared(excess) / 12;
    const double variance = seen * out.state.covariance * seen.transpose() + noise;
    const double innovation = offset(now) - seen * out.state.mean;
    const double surprise = squared(innovation) / variance;
    if (surprise <= kGate) {
      const Eigen::Vector3d gain = out.state.covariance * seen.transpose() / variance;
      const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - gain * seen;
      out.state.mean += gain * innovation;
      // Joseph's form stays positive whatever the rounding.
      out.state.covariance = (rest * out.state.covariance * rest.transpose()).eval();
      out.state.covariance += noise * gain * gain.transpose();
      out.surprise += surprise;
      ++out.fitting;
      contradicting = 0;
      out.misfit = {};
      fitting_us2 = now.board_us2;
      continue;
    }
    const double since_fitting = static_cast<double>(now.board_us2 - fitting_us2) * 0.5e-6;
    out.misfit.size = std::max(out.misfit.size, std::abs(innovation));
    out.misfit.rate = out.misfit.size / std::max(since_fitting, 1e-3);
    if (++contradicting == kContradicting) {
      out.begin = i - kContradicting + 1;
      out.jump = std::max(out.jump, out.misfit.size);
      i = out.begin;
      start(out.state, entry(i), this->excess(entry(i)));
      contradicting = 0;
      out.misfit = {};
      fitting_us2 = entry(i).board_us2;
    }
  }
  return out;
}

double ClockSync::variance_after(double seconds) const noexcept {
  const Eigen::Matrix3d& p = state_.covariance;
  const double q = squared(options_.wander_ppm * 1e-6);
  const double variance = p(0, 0) + 2 * seconds * p(0, 1) + seconds * seconds * p(1, 1) +
                          q * std::abs(seconds * seconds * seconds) / 3 +
                          squared(state_.mean[2] * least_.sigma) + squared(unsteady_) +
                          squared(misfit_.size + std::abs(seconds) * misfit_.rate);
  return std::max(variance, kMinVariance);
}

/// Uniform between the bounds that the least round trip sets. None is below zero: if one is, wire
/// times are not as told, and half of what it is below is the least that they err by.
double ClockSync::asymmetry_sigma() const noexcept {
  if (asymmetry_sigma_ >= 0) return asymmetry_sigma_ / 2;
  return std::hypot(least_.time / std::sqrt(12.0), least_.beyond_zero / 2);
}

HostTime ClockSync::to_host(std::uint32_t board_us) const noexcept {
  const std::int64_t board = unwrap(board_us, board_reference_us2_ / 2);
  const std::int64_t since_us2 = 2 * board - board_reference_us2_;
  const double since = static_cast<double>(since_us2) * 0.5e-6;
  const double correction = state_.mean[0] + state_.mean[1] * since + asymmetry_ / 2;
  const double variance = variance_after(since);
  return {host_reference_ + Duration(since_us2 * 500) + to_duration(correction),
          to_duration(std::sqrt(variance + squared(asymmetry_sigma()))),
          to_duration(std::sqrt(variance))};
}

std::uint32_t ClockSync::to_board(TimePoint host) const noexcept {
  const double since = std::chrono::duration<double>(host - host_reference_).count();
  const double board = (since - state_.mean[0] - asymmetry_ / 2) / (1 + state_.mean[1]) * 1e6;
  const double whole =
      std::clamp(board, -1e15, 1e15) + 0.5 * static_cast<double>(board_reference_us2_ % 2);
  return static_cast<std::uint32_t>(board_reference_us2_ / 2 + std::llround(whole));
}

ClockReport ClockSync::report() const noexcept {
  ClockReport out;
  out.exchanges = static_cast<std::uint32_t>(count_);
  out.accepted = accepted_;
  out.rejected = rejected_;
  out.jumps = jumps_;
  if (count_ == 0) return out;
  const double rate = 1 + state_.mean[1];
  out.skew_ppm = (1 / rate - 1) * 1e6;
  out.skew_sigma_ppm = std::sqrt(std::max(state_.covariance(1, 1), 0.0)) * 1e6;
  out.round_trip_us = least_.time * 1e6;
  out.one_sided = std::clamp(0.5 + state_.mean[2], 0.0, 1.0);
  out.random_sigma = to_duration(std::sqrt(variance_after(1)));
  out.asymmetry_sigma = to_duration(asymmetry_sigma());
  out.converged = count_ >= kFewForRoundTrip && out.random_sigma <= kConverged;
  return out;
}

void CounterClock::start(std::uint16_t counter, TimePoint arrival) noexcept {
  known_ = true;
  reference_ = arrival;
  state_ << 0, nominal_;
  const double period_sigma = kPeriodSigma * nominal_;
  jitter_variance_ = kFirstJitter * kFirstJitter;
  covariance_ << jitter_variance_, 0, 0, period_sigma * period_sigma;
  last_ = counter;
  misfits_ = 0;
}

HostTime CounterClock::now() const noexcept {
  const Duration sigma = to_duration(std::sqrt(covariance_(0, 0)));
  return {reference_ + to_duration(state_[0]), sigma, sigma};
}

HostTime CounterClock::take(std::uint16_t counter, TimePoint arrival) noexcept {
  if (!known_) {
    start(counter, arrival);
    return now();
  }
  const double arrived = std::chrono::duration<double>(arrival - reference_).count();
  const auto difference = static_cast<std::uint16_t>(counter - last_);
  const double steps = difference;
  last_ = counter;
  if (difference == 0 || steps > kMaxSteps) {
    start(counter, arrival);
    ++restarts_;
    return now();
  }
  Eigen::Matrix2d step;
  step << 1, steps, 0, 1;
  state_ = (step * state_).eval();
  covariance_ = (step * covariance_ * step.transpose()).eval();
  const double wander = kWander * nominal_;
  covariance_(1, 1) += wander * wander * steps * nominal_;

  const double innovation = arrived - state_[0];
  const double variance = covariance_(0, 0) + jitter_variance_;
  if (innovation * innovation > kCounterGate * variance) {
    if (++misfits_ * steps * nominal_ > kMisfitTime) {
      start(counter, arrival);
      ++restarts_;
    }
    return now();
  }
  misfits_ = 0;
  const Eigen::Vector2d gain = covariance_.col(0) / variance;
  state_ += gain * innovation;
  covariance_ = (covariance_ - gain * covariance_.row(0)).eval();
  jitter_variance_ += kForget * (innovation * innovation - jitter_variance_);
  jitter_variance_ = std::max(jitter_variance_, kMinJitter * kMinJitter);
  return now();
}

}  // namespace tagwrench::link
