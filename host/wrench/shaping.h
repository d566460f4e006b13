// Wrench -> motion of an input device: mounting, dead zone, full scale.
#pragma once

#include <Eigen/Core>

#include "host/types.h"

namespace tagwrench {

struct ShapingOptions {
  /// Rows: HID X, Y, Z as camera axes. Default: the camera looks up from below the platform, its x
  /// to the user's right.
  Eigen::Matrix3d hid_R_camera = Eigen::Vector3d(1, -1, -1).asDiagonal();
  Vector6 full_scale =
      (Vector6() << 0.6, 0.6, 2.0, 0.012, 0.012, 0.008).finished();  ///< N, N m, per HID axis
  Vector6 dead_zone =
      (Vector6() << 0.02, 0.02, 0.08, 0.0006, 0.0006, 0.0003).finished();  ///< N, N m, per HID axis
};

class Shaping {
 public:
  explicit Shaping(const ShapingOptions& options) : options_(options) {}

  /// Fills sample.motion: -1..1 per HID axis, exactly zero inside the dead zone and continuous at
  /// its edge, zero for a status that carries no numbers.
  void shape(Sample& sample) const noexcept;

 private:
  ShapingOptions options_;
};

}  // namespace tagwrench
