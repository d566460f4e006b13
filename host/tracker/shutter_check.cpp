#include "host/tracker/shutter_check.h"

#include <algorithm>
#include <exception>
#include <iterator>

#include "host/tracker/projection.h"
#include "host/tracker/trust.h"

namespace tagwrench {
namespace {

/// Times that cameras take from the first row to the last, as parts of kUnit.
constexpr double kUnit = 10e-3;  // s
constexpr double kReadouts[] = {1, 2, 3, 4};
/// A shear must be seen to be mended: motion of the platform in the image
/// during kUnit, px.
constexpr double kMinMotion_px = 0.5;
constexpr int kEnough = 8;         ///< pictures mended
constexpr double kMaxOfAll = 0.5;  ///< of the pictures tried

}  // namespace

bool ShutterCheck::rolls(const PhotometricAligner& aligner, const PixelWindow& image,
                         TimePoint time, const Eigen::Isometry3d& pose,
                         const PhotometricState& light) noexcept {
  if (done_) return false;
  const Vector6 velocity = predictor_.velocity(time, pose);
  const CameraModel& camera = aligner.pixels().camera;
  const double speed_px =
      camera.fy_px * velocity.head<2>().norm() / std::max(1e-3, pose.translation().z());
  if (!(speed_px * kUnit > kMinMotion_px)) return false;
  try {
    if (!trial_.ready()) {
      PixelTemplate pixels = aligner.pixels();
      pixels.readout = kUnit;
      trial_.set_template(std::move(pixels));
    }
  } catch (const std::exception&) {
    done_ = true;  // out of memory
    return false;
  }
  ++tried_;
  if (mended(image, pose, velocity, light)) ++mended_;
  done_ = mended_ >= kEnough && mended_ > kMaxOfAll * tried_;
  return done_;
}

/// Only the product of readout and velocity matters.
bool ShutterCheck::mended(const PixelWindow& image, const Eigen::Isometry3d& pose,
                          const Vector6& velocity, const PhotometricState& light) noexcept {
  const auto good = [&](double readout) {
    PhotometricState state = light;
    const PhotometricFit fit = trial_.align(image, pose, readout * velocity, state);
    return fit.converged && trusted(fit, state);
  };
  const auto backwards = [&](double readout) { return good(-readout); };
  return std::any_of(std::begin(kReadouts), std::end(kReadouts), good) &&
         std::none_of(std::begin(kReadouts), std::end(kReadouts), backwards);
}

}  // namespace tagwrench
