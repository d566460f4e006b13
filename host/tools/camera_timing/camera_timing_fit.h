// The least-squares fit behind measure_camera_timing().
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {

/// Of a straight line through points, each with its weight.
struct LineSums {
  double n = 0, w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void add(double at, double value, double weight = 1) noexcept {
    n += 1;
    w += weight;
    x += weight * at;
    y += weight * value;
    xx += weight * at * at;
    xy += weight * at * value;
    yy += weight * value * value;
  }
  double spread() const noexcept { return w * xx - x * x; }
  double slope() const noexcept { return (w * xy - x * y) / spread(); }
  double offset() const noexcept { return (y - slope() * x) / w; }
};

/// What is alike in all pictures. Times in s.
struct CameraTimes {
  double latency = 0;
  double jitter = 0;  ///< standard deviation
  double readout = 0, exposure = 0;
};

class CameraTimingFit {
 public:
  struct Picture {
    double time = 0;    ///< middle of its exposure, host clock, s
    double sigma = 0;   ///< s
    double cost = 0;    ///< weighted squares of its residuals, without the prior
    double margin = 0;  ///< by how much the next best time is worse
    bool good = true;   ///< shows the light of `time`
    bool alone = true;  ///< not the same picture as its predecessor's
  };

  /// Borrows the input.
  explicit CameraTimingFit(const CameraTimingInput& input);

  /// Finds latency and read-out to about a bit by correlation. False: the light is not that of the
  /// pattern.
  bool find();
  /// From there to the best fit.
  void refine();
  /// Whether rows are exposed one after the other, so that pictures tell their times.
  bool rolls() const noexcept;
  /// Takes what is alike in all pictures from elsewhere, and their times from that.
  void set_camera(const CameraTimes& camera);

  const LightSignal& light() const noexcept { return light_; }

  const CameraTimes& camera() const noexcept { return camera_; }
  const std::vector<Picture>& pictures() const noexcept { return pictures_; }
  /// Of read-out and exposure, s^2.
  const Eigen::Matrix2d& covariance() const noexcept { return covariance_; }
  /// By how much the mean of all times follows an error of read-out and of exposure.
  const Eigen::Vector2d& time_by_camera() const noexcept { return time_by_camera_; }

  /// Weighted squares of what is left of a picture if it was taken at `time`.
  double cost(std::size_t picture, double time) const noexcept;
  /// The same of its own time, and what that is off from its stamp.
  double own_cost(std::size_t picture) const noexcept {
    return pictures_[picture].cost + prior(picture, pictures_[picture].time);
  }
  /// Where the stamp says that it was taken.
  double expected(std::size_t picture) const noexcept {
    return input_.frames[picture].stamp - camera_.latency;
  }

 private:
  double prior(std::size_t picture, double time) const noexcept;
  double prior_weight(std::size_t picture, double time) const noexcept;
  ExposureTimes times(double middle) const noexcept {
    return {middle, camera_.readout, camera_.exposure};
  }
  void guess_exposure();  ///< and jitter
  void search(std::size_t picture) noexcept;
  void settle(std::size_t picture) noexcept;
  void judge() noexcept;
  void find_repeats() noexcept;
  void fit_bands() noexcept;
  void fit_delay() noexcept;
  double step() noexcept;

  const CameraTimingInput& input_;
  LightSignal light_;
  std::size_t bands_;
  CameraTimes camera_;
  std::vector<Picture> pictures_;
  std::vector<double> dark_, gain_, weight_;  ///< per band; weight is 1 / variance
  double least_noise_;                        ///< of a band's gain
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d time_by_camera_ = Eigen::Vector2d::Zero();
};

}  // namespace tagwrench
