#include "host/tracker/shutter_check.h"

#include <algorithm>
#include <iterator>

namespace tagwrench {
namespace {

/// Times that cameras take from the first row to the last, in kUnit.
constexpr double kUnit = 10e-3;  // s
constexpr double kReadouts[] = {1, 2, 3, 4};
/// A shear must be seen to be mended: motion of the platform in the image
/// during kUnit, px.
constexpr double kMinMotion_px = 0.5;
constexpr int kEnough = 8;         ///< pictures mended
constexpr double kMaxOfAll = 0.5;  ///< of the pictures tried

/// Only the product of readout and velocity matters.
bool mended(PhotometricAligner& aligner, const PixelWindow& image, const Eigen::Isometry3d& pose,
            const Vector6& velocity, const PhotometricState& before) noexcept {
  const auto fits = [&](double readout) {
    PhotometricState state = before;
    const PhotometricFit fit = aligner.align(image, pose, {kUnit, readout * velocity}, state);
    return accepted(fit, state);
  };
  const auto fits_backwards = [&](double readout) { return fits(-readout); };
  return std::any_of(std::begin(kReadouts), std::end(kReadouts), fits) &&
         std::none_of(std::begin(kReadouts), std::end(kReadouts), fits_backwards);
}

}  // namespace

bool ShutterCheck::rolls(PhotometricAligner& aligner, const PixelWindow& image, TimePoint time,
                         const Eigen::Isometry3d& pose, const PhotometricState& before) noexcept {
  if (done_) return false;
  const Vector6 velocity = predictor_.velocity(time, pose);
  const double speed_px = aligner.pixels().camera.fy_px * velocity.head<2>().norm() /
                          std::max(1e-3, pose.translation().z());
  if (!(speed_px * kUnit > kMinMotion_px)) return false;
  ++tried_;
  if (mended(aligner, image, pose, velocity, before)) ++mended_;
  done_ = mended_ >= kEnough && mended_ > kMaxOfAll * tried_;
  return done_;
}

}  // namespace tagwrench
