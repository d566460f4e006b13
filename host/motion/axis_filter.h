// Smoothing of six axes, all of them alike: what is pushed together stays together.
#pragma once

#include <cstdint>

#include "host/core/types.h"

namespace tagwrench {

enum class FilterKind : std::uint8_t { none, exponential, one_euro };

struct FilterOptions {
  FilterKind kind = FilterKind::one_euro;

  /// Exponential: `weight` of the newest value at `weight_hz` frames a second; at other rates its
  /// time constant stays. As in Ouyang and Howe, ICRA 2020: 0.2 at 25 Hz, 179 ms.
  double weight = 0.2;
  double weight_hz = 25;

  /// One Euro (Casiez, Roussel and Vogel, CHI 2012): the cut-off is `cutoff_hz` for a hand that
  /// holds still, and `hz_per_speed` more for each full scale a second that the fastest axis moves;
  /// that speed is itself smoothed with `speed_cutoff_hz`.
  /// The sensor's noise needs little of it (on the simulated published sensor, at rest, 0.0003 of
  /// full scale in Fz, a tenth of a count of a SpaceMouse; other axes less), a hand's tremor more.
  /// At 60 frames a second these leave a third of both; a push to half of full scale within 0.5 s
  /// lags 8 ms, one to a tenth within 1 s lags 38 ms. The exponential filter lags 136 and 153 ms.
  double cutoff_hz = 2;
  double hz_per_speed = 12;
  double speed_cutoff_hz = 3;

  bool operator==(const FilterOptions&) const = default;
};

/// Steps follow the frames' own times: a lost frame is a longer step.
class AxisFilter {
 public:
  /// `full_scale`: what speed counts in, per axis, greater than 0.
  AxisFilter(const FilterOptions& options, const Vector6& full_scale) noexcept
      : options_(options), full_scale_(full_scale) {}

  /// From here on as if `value` had been there for ever.
  void start(const Vector6& value) noexcept;
  /// The next value, `seconds` > 0 after the last.
  const Vector6& step(double seconds, const Vector6& value) noexcept;
  /// One axis, or all of them, forget what they lag behind.
  void settle(int axis) noexcept { smooth_[axis] = last_[axis]; }
  void settle() noexcept { smooth_ = last_; }
  const Vector6& value() const noexcept { return smooth_; }

 private:
  double weight(double seconds, const Vector6& value) noexcept;

  FilterOptions options_;
  Vector6 full_scale_;
  Vector6 smooth_ = Vector6::Zero();
  Vector6 last_ = Vector6::Zero();   ///< as it came
  Vector6 speed_ = Vector6::Zero();  ///< full scales a second, smoothed
};

}  // namespace tagwrench
