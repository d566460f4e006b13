// Times of a sensor that counts its samples: from the counter, not from when the bytes came.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "host/board/clock_sync.h"
#include "host/core/types.h"

namespace tagwrench::link {

/// time = start + period * count, by a Kalman filter over the arrivals; the period is learned
/// around the nominal one. Arrivals are late by a mean that nobody can see here (the sensor's
/// filter, the driver): times are those of a frame that is as late as they are on average.
class CounterClock {
 public:
  explicit CounterClock(double period_s) noexcept : nominal_(period_s) {}

  /// Of a sample that was there at `arrival`. A counter that does not go on, or arrivals that do
  /// not fit for half a second, start it anew.
  HostTime take(std::uint16_t counter, TimePoint arrival) noexcept;
  void restart() noexcept { known_ = false; }

  double period() const noexcept { return known_ ? state_[1] : nominal_; }
  std::uint32_t restarts() const noexcept { return restarts_; }

 private:
  void start(std::uint16_t counter, TimePoint arrival) noexcept;
  HostTime now() const noexcept;

  double nominal_;
  bool known_ = false;
  TimePoint reference_{};
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();  ///< time of the last sample since the
                                                     ///< reference (s), period (s)
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  double jitter_variance_ = 0;  ///< of arrivals, s^2
  std::uint16_t last_ = 0;
  unsigned misfits_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace tagwrench::link
