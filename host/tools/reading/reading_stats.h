// Rate, jitter, gaps and latency of a stream of reports, in constant memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "host/core/types.h"

namespace tagwrench {

/// Durations counted in classes that are 2 % wide, from 1 us to about a minute; what is outside
/// counts in the outermost ones.
class DurationHistogram {
 public:
  void add(Duration value) noexcept;
  std::uint64_t count() const noexcept { return count_; }
  Duration max() const noexcept { return max_; }
  /// The duration below which this part (0..1) lies, to 2 %; never above max(). 0 without any.
  Duration quantile(double part) const noexcept;

 private:
  std::array<std::uint32_t, 1024> classes_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

class ReadingStats {
 public:
  void arrived(TimePoint time) noexcept;
  /// Of a wrench sample, after arrived().
  void sampled(std::uint32_t sequence, std::optional<Duration> latency) noexcept;
  void stranger() noexcept { ++strangers_; }
  /// Counts anew, but knows the last report: no interval and no gap between two spans is lost.
  void next_span() noexcept;
  /// The device was away: the time until the next report is no interval, its sequence starts anew.
  void interrupted() noexcept;

  std::uint64_t reports() const noexcept { return reports_; }
  std::uint64_t missing() const noexcept { return missing_; }
  std::uint64_t gaps() const noexcept { return gaps_; }
  std::uint64_t strangers() const noexcept { return strangers_; }
  double rate_hz() const noexcept;  ///< 0 with fewer than two reports
  Duration interval_mean() const noexcept;
  Duration interval_std() const noexcept;  ///< of a population, not of a sample
  Duration interval_max() const noexcept { return interval_max_; }
  const DurationHistogram& latency() const noexcept { return latency_; }

 private:
  std::uint64_t reports_ = 0;
  std::uint64_t intervals_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t strangers_ = 0;
  std::optional<TimePoint> last_;
  std::optional<std::uint32_t> last_sequence_;
  double mean_s_ = 0;
  double squares_s2_ = 0;  ///< sum of squared deviations from the mean (Welford 1962)
  Duration interval_max_{};
  DurationHistogram latency_;
};

/// A latency beyond it is none: the capture times are of another clock.
inline constexpr Duration kMaxLatency = std::chrono::seconds(10);

/// now - captured, where both can be of one clock: those of a simulated sensor, a recording or
/// another computer are not.
std::optional<Duration> plausible_latency(TimePoint now, TimePoint captured) noexcept;

}  // namespace tagwrench
