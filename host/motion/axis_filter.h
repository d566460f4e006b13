// Smoothing of six axes, all of them alike: what is pushed together stays together.
#pragma once

#include <array>
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

// How much the wrench scatters while nobody pushes.

/// The larger of two: what the samples say of their own noise, and how they really scatter from
/// frame to frame (second differences, which a slow drift does not touch). Learnt at rest alone,
/// so that a hand's tremor numbs nothing, and a push has the same newtons from its first frame to
/// its last.
///
/// Why eight standard deviations of it are a dead zone: an hour at 60 frames a second on six axes
/// is 1.3 million numbers. Normal noise leaves six once in 390 hours. That of rendered JPEG
/// pictures has longer tails: of 89,850 numbers 40 lay beyond four and two beyond five, where
/// normal noise has 6 and 0.05. If each sigma more is 20 times rarer, eight are left once in 280
/// hours, without a filter and without a dead zone of the user's.
class NoiseFloor {
 public:
  /// `seconds` after the last frame, 0 for the first. `rest`: nobody pushes, as far as is known.
  void add(double seconds, const Vector6& value, const Vector6& sigma, bool rest) noexcept;

  /// One standard deviation; zero before the first frame.
  const Vector6& sigma() const noexcept { return sigma_; }

 private:
  void learn_scatter(double seconds, double weight, const Vector6& value) noexcept;

  int known_ = 0;     ///< of the last two values: those in a row, at rest
  bool any_ = false;  ///< frame, ever
  double last_step_ = 0;
  std::array<Vector6, 2> values_ = {Vector6::Zero(), Vector6::Zero()};  ///< last, and before it
  Vector6 stated_ = Vector6::Zero();                                    ///< variance
  Vector6 scatter_ = Vector6::Zero();                                   ///< variance
  Vector6 sigma_ = Vector6::Zero();
};

}  // namespace tagwrench
