// Whether views and fit are good enough, and what to do if not.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/calibration/camera/fit.h"
#include "host/calibration/camera/limits.h"
#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr int kMinRegions = 6;         // of nine
constexpr double kMinSpan = 0.6;       // of width and height
constexpr double kMinTilt = 12;        // degrees
constexpr double kFocalSigma = 0.003;  // of the focal length
constexpr double kCentreSigma_px = 5;
constexpr double kMaxRms_px = 1.0;
constexpr double kAspect = 0.1;      // of 1
constexpr double kCentreOff = 0.25;  // of width and height, from the middle
constexpr double kDegrees = 180 / std::numbers::pi;

/// Whether the lens model still maps larger angles to larger radii at the image's farthest corner.
bool monotonic(const CameraModel& camera) {
  const double x = std::max(camera.cx_px, camera.width_px - 1 - camera.cx_px) / camera.fx_px;
  const double y = std::max(camera.cy_px, camera.height_px - 1 - camera.cy_px) / camera.fy_px;
  const double farthest = std::hypot(x, y);
  const double k1 = camera.distortion[0];
  const double k2 = camera.distortion[1];
  const double k3 = camera.distortion[4];
  double reached = 0;
  for (double r = 0; reached < farthest; r += 0.01 * farthest) {
    const double r2 = r * r;
    if (1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) <= 0) return false;
    reached = r * (1 + r2 * (k1 + r2 * (k2 + r2 * k3)));
    if (r > 3 * farthest) return false;
  }
  return true;
}

}  // namespace

void check_views(const std::vector<CameraView>& views, const Coverage& coverage) {
  if (static_cast<int>(views.size()) < kMinCameraViews) {
    throw ConfigError(
        fmt::format("only {} different usable views, {} are needed and 20 are good: show the board "
                    "at more places, "
                    "distances and tilts",
                    views.size(), kMinCameraViews));
  }
  if (coverage.regions() < kMinRegions || coverage.span() < kMinSpan) {
    throw ConfigError(
        fmt::format("the views leave too much of the image empty (corners span {:.0f} % of it, and "
                    "miss {}): show "
                    "the board there too",
                    100 * coverage.span(), listed(coverage.missing_regions())));
  }
}

void check_fit(const CameraFit& fit, const Coverage& coverage) {
  const CameraModel& camera = fit.camera;
  const double tilt = coverage.largest_tilt() * kDegrees;
  if (tilt < kMinTilt) {
    throw ConfigError(fmt::format(
        "the board is nearly frontal in every view (at most {:.0f} degrees), so the focal "
        "length cannot be told from the distance: tilt it by 20 degrees and more, each way",
        tilt));
  }
  if (fit.rms_px > kMaxRms_px) {
    throw ConfigError(
        fmt::format("no camera explains the views better than {:.2f} px: check that --board "
                    "describes the board "
                    "and that it is flat, and hold it still",
                    fit.rms_px));
  }
  const double focal = std::max(fit.sigma[0] / camera.fx_px, fit.sigma[1] / camera.fy_px);
  if (!(focal < kFocalSigma) || !(std::max(fit.sigma[2], fit.sigma[3]) < kCentreSigma_px)) {
    throw ConfigError(fmt::format(
        "the views do not determine the camera: fx {:.1f} +- {:.1f} px, centre +- {:.1f} px "
        "(largest "
        "tilt {:.0f} degrees): show the board larger, sharper and tilted more, each way",
        camera.fx_px, fit.sigma[0], std::max(fit.sigma[2], fit.sigma[3]), tilt));
  }
  if (std::abs(camera.fx_px / camera.fy_px - 1) > kAspect) {
    throw ConfigError(
        fmt::format("fx {:.1f} and fy {:.1f} px differ as no camera's do: check --board, and that "
                    "its print was not "
                    "stretched",
                    camera.fx_px, camera.fy_px));
  }
  const double off_x = std::abs(camera.cx_px / (camera.width_px - 1) - 0.5);
  const double off_y = std::abs(camera.cy_px / (camera.height_px - 1) - 0.5);
  if (std::max(off_x, off_y) > kCentreOff) {
    throw ConfigError(fmt::format(
        "the optical axis would meet the image at ({:.0f}, {:.0f}) px, far from its middle: is the "
        "image cropped? Otherwise tilt the board more, each way",
        camera.cx_px, camera.cy_px));
  }
  if (!monotonic(camera)) {
    throw ConfigError(
        "the distortion found folds the image's corners over: show the board in the corners of the "
        "image too");
  }
}

}  // namespace tagwrench
