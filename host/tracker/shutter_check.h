// Are pictures not accepted because a rolling shutter shears them while the target moves, and the
// sensor does not say so?
#pragma once

#include "host/tracker/photometric.h"
#include "host/tracker/predictor.h"

namespace tagwrench {

/// Tries such pictures of a moving target once more, as if their rows had been exposed one after
/// the other. What else spoils pictures (things before the lens, glare, blur of motion) is not
/// mended by that; nor is a sheared one by rows in the other order.
class ShutterCheck {
 public:
  /// Where the target is in the frame of this time, accepted or not.
  void seen(TimePoint time, const Eigen::Isometry3d& camera_T_platform) noexcept {
    predictor_.add(time, camera_T_platform);
  }
  void lost() noexcept { predictor_.start({}, Eigen::Isometry3d::Identity()); }

  /// Before seen(): the picture of a fit that was not accepted, its pose, and the state before it.
  /// True once, when enough pictures have been mended and few have not.
  bool rolls(PhotometricAligner& aligner, const PixelWindow& image, TimePoint time,
             const Eigen::Isometry3d& pose, const PhotometricState& before) noexcept;

 private:
  ConstantVelocityPredictor predictor_;  ///< through frames that are not accepted too
  int mended_ = 0;
  int tried_ = 0;
  bool done_ = false;
};

}  // namespace tagwrench
