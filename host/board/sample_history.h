// The value of a sampled quantity at another clock's time: that of a frame.
#pragma once

#include <cstddef>
#include <cstdint>

#include "host/board/ring.h"
#include "host/core/types.h"

namespace tagwrench::link {

enum class AlignStatus : std::uint8_t {
  ok,
  empty,    ///< nothing was sampled yet
  too_old,  ///< before all that is kept
  too_new,  ///< after the last sample: ask again later, it is not guessed
  gap,      ///< samples are missing there
};

struct Aligned {
  AlignStatus status = AlignStatus::empty;
  double value = 0;
  double sigma = 0;  ///< one standard deviation: noise, time and interpolation
};

struct HistoryOptions {
  double period = 0;  ///< s, nominal; neighbours further apart than 1.5 of it are a gap
  double delay =
      0;  ///< s between an event and the time stamp of the sample that shows it (filters)
};

/// Keeps the last samples and interpolates linearly between neighbours. The noise is what the
/// samples' third differences show: their variance is 20 times that of white noise, and signals
/// that change slowly have none. The interpolation's error is its bound u (1 - u) / 2 h^2 |f''|, by
/// the second differences.
class SampleHistory {
 public:
  static constexpr std::size_t kRoom = 512;

  explicit SampleHistory(const HistoryOptions& options) noexcept : options_(options) {}

  /// `sigma` is what is known of the value's uncertainty besides noise (a scale); `lost_before`
  /// tells of samples that are missing before this one. Times must grow; others are ignored.
  void add(TimePoint time, Duration time_sigma, double value, double sigma = 0,
           bool lost_before = false) noexcept;
  void clear() noexcept;

  Aligned at(TimePoint time) const noexcept;
  /// Standard deviation of one sample, as seen; 0 before there are enough.
  double noise() const noexcept;

 private:
  struct Sample {
    TimePoint time{};
    double time_sigma = 0;  ///< s
    double value = 0;
    double sigma = 0;
    bool after_gap = false;
  };
  std::size_t first_after(TimePoint time) const noexcept;
  double bend(std::size_t right) const noexcept;
  void watch_noise() noexcept;

  HistoryOptions options_;
  Ring<Sample, kRoom> samples_;
  double third_squares_ = 0;  ///< mean, forgetting
  std::uint64_t thirds_ = 0;
};

}  // namespace tagwrench::link
