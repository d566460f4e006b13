#include "host/tools/reading/reading_stats.h"

#include <algorithm>
#include <cmath>

#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {
namespace {

constexpr double kMin_ns = 1e3;
const double kLogStep = std::log(1.02);

Duration from_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

void DurationHistogram::add(Duration value) noexcept {
  const double ratio = std::max(1.0, static_cast<double>(value.count()) / kMin_ns);
  const auto index = static_cast<std::size_t>(std::log(ratio) / kLogStep);
  ++classes_[std::min(index, classes_.size() - 1)];
  ++count_;
  max_ = std::max(max_, value);
}

Duration DurationHistogram::quantile(double part) const noexcept {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    below += classes_[i];
    if (below >= wanted && below > 0) {
      const double upper_ns = kMin_ns * std::exp(kLogStep * static_cast<double>(i + 1));
      return std::min(max_, Duration(static_cast<Duration::rep>(upper_ns)));
    }
  }
  return max_;
}

void ReadingStats::arrived(TimePoint time) noexcept {
  ++reports_;
  if (last_) {
    const Duration interval = time - *last_;
    const double s = std::chrono::duration<double>(interval).count();
    ++intervals_;
    const double off = s - mean_s_;
    mean_s_ += off / static_cast<double>(intervals_);
    squares_s2_ += off * (s - mean_s_);
    interval_max_ = std::max(interval_max_, interval);
  }
  last_ = time;
}

void ReadingStats::sampled(std::uint32_t sequence, std::optional<Duration> latency) noexcept {
  if (last_sequence_) {
    const std::uint32_t missing = tagwrench_missing(*last_sequence_, sequence);
    missing_ += missing;
    gaps_ += missing > 0 ? 1 : 0;
  }
  last_sequence_ = sequence;
  if (latency) latency_.add(*latency);
}

void ReadingStats::next_span() noexcept {
  const auto last = last_;
  const auto last_sequence = last_sequence_;
  *this = {};
  last_ = last;
  last_sequence_ = last_sequence;
}

void ReadingStats::interrupted() noexcept {
  last_.reset();
  last_sequence_.reset();
}

double ReadingStats::rate_hz() const noexcept {
  return intervals_ > 0 && mean_s_ > 0 ? 1 / mean_s_ : 0;
}

Duration ReadingStats::interval_mean() const noexcept { return from_seconds(mean_s_); }

Duration ReadingStats::interval_std() const noexcept {
  if (intervals_ == 0) return Duration(0);
  return from_seconds(std::sqrt(squares_s2_ / static_cast<double>(intervals_)));
}

std::optional<Duration> plausible_latency(TimePoint now, TimePoint captured) noexcept {
  const Duration latency = now - captured;
  if (latency < Duration(0) || latency >= kMaxLatency) return std::nullopt;
  return latency;
}

}  // namespace tagwrench
