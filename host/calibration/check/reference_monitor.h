// A sensor beside a load cell that stays on it for good: scale and zero, compared all the time.
#pragma once

#include <Eigen/Core>

#include "host/core/types.h"

namespace tagwrench {

enum class ReferenceFault : std::uint8_t { none, scale, zero };

/// A straight line through what the sensor measured along the cell's line of action, over what the
/// cell felt: its slope is the scale, its value at no force the zero. Weighted least squares that
/// forgets exponentially, with Huber's weights against what does not belong. Pure; no heap.
class ReferenceMonitor {
 public:
  struct Options {
    double memory = 60;        ///< s
    double scale = 0.02;       ///< slope this far from 1 is a fault ...
    double zero = 0.02;        ///< ... and so is a zero of this part of the range along the line,
    double sigmas = 3;         ///< if they are known that well
    double excitation = 0.03;  ///< of the range: forces that vary less tell nothing of the scale
    double dwell = 5;          ///< s for which a fault must last before it is one
    double off_line = 0.10;    ///< of the range: other loads than the cell's; not compared
    double correlation = 0.2;  ///< s, between frames whose errors are independent: a hand's motion
  };
  explicit ReferenceMonitor(const Options& options) : options_(options) {}

  /// `wrench`: as measured; `line`: the wrench of 1 N along the line, in the same frame; `range`:
  /// of the axes, 0 where it is not known; `force`: what the cell felt at that time, N. A fault is
  /// returned once for each cause.
  ReferenceFault add(TimePoint time, const Vector6& wrench, const Vector6& line,
                     const Vector6& range, double force) noexcept;

  double scale() const noexcept { return slope_; }              ///< measured over known
  double scale_sigma() const noexcept { return slope_sigma_; }  ///< infinite: not known yet
  double zero() const noexcept { return zero_; }                ///< N, along the line
  double zero_sigma() const noexcept { return zero_sigma_; }
  /// Force that the range allows along the line, N.
  double range() const noexcept { return range_; }

 private:
  struct Suspicion {
    double lasted = 0;  ///< s
    bool told = false;
  };
  void take(double weight, double force, double measured) noexcept;
  void fit() noexcept;
  bool confirmed(Suspicion& suspicion, bool now, double dt) const noexcept;

  Options options_;
  bool started_ = false;
  TimePoint last_{};
  double range_ = 0;
  double weight_ = 0, independent_ = 0;
  double mean_force_ = 0, mean_measured_ = 0;
  double force_force_ = 0, force_measured_ = 0, measured_measured_ = 0;  ///< about the means
  double slope_ = 0, slope_sigma_ = 1e300;
  double zero_ = 0, zero_sigma_ = 1e300;
  double residual_ = 0;  ///< standard deviation, N
  Suspicion scale_fault_, zero_fault_;
};

}  // namespace tagwrench
