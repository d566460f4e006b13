#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/calibration/camera/fit.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"

namespace tagwrench {
namespace {

constexpr int kMinCorners = 6;                         // in a region
constexpr double kTilt = 20 * std::numbers::pi / 180;  // asked for, each way
constexpr double kDistanceRatio = 1.2;                 // farthest to nearest
constexpr std::array<const char*, 9> kRegions = {"top left",    "top",    "top right",
                                                 "left",        "middle", "right",
                                                 "bottom left", "bottom", "bottom right"};
constexpr std::array<const char*, 4> kEdges = {"left", "right", "top", "bottom"};

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

void Coverage::add(const std::vector<BoardCorner>& corners, const BoardPose& pose) {
  for (const BoardCorner& corner : corners) {
    const int column = std::clamp(static_cast<int>(3 * (corner.pixel.x() + 0.5) / width_), 0, 2);
    const int row = std::clamp(static_cast<int>(3 * (corner.pixel.y() + 0.5) / height_), 0, 2);
    ++corners_[static_cast<std::size_t>(3 * row + column)];
    low_ = low_.cwiseMin(corner.pixel);
    high_ = high_.cwiseMax(corner.pixel);
  }
  // Where the normal leans to x, the plane comes nearer there.
  const Eigen::Vector3d& n = pose.normal;
  const double x = std::atan2(n.x(), n.z());
  const double y = std::atan2(n.y(), n.z());
  tilted_[0] |= x <= -kTilt;
  tilted_[1] |= x >= kTilt;
  tilted_[2] |= y <= -kTilt;
  tilted_[3] |= y >= kTilt;
  largest_tilt_ = std::max(largest_tilt_, std::acos(std::clamp(n.z(), -1.0, 1.0)));
  nearest_ = nearest_ == 0 ? pose.distance : std::min(nearest_, pose.distance);
  farthest_ = std::max(farthest_, pose.distance);
}

int Coverage::regions() const {
  return static_cast<int>(
      std::count_if(corners_.begin(), corners_.end(), [](int n) { return n >= kMinCorners; }));
}

std::vector<std::string> Coverage::missing_regions() const {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < corners_.size(); ++i)
    if (corners_[i] < kMinCorners) out.emplace_back(kRegions[i]);
  return out;
}

std::vector<std::string> Coverage::missing() const {
  std::vector<std::string> out;
  if (const std::vector<std::string> regions = missing_regions(); !regions.empty())
    out.push_back("the board at the " + listed(regions) + " of the picture");
  std::vector<std::string> edges;
  for (std::size_t i = 0; i < tilted_.size(); ++i)
    if (!tilted_[i]) edges.emplace_back(kEdges[i]);
  if (!edges.empty())
    out.push_back("its " + listed(edges) + " edge tilted 20 degrees or more toward the lens");
  if (farthest_ < kDistanceRatio * nearest_)
    out.emplace_back("the board a fifth nearer or farther, as far as it stays sharp");
  return out;
}

double Coverage::span() const {
  const Eigen::Vector2d part = (high_ - low_).cwiseQuotient(Eigen::Vector2d(width_, height_));
  return std::max(0.0, part.minCoeff());
}

void check_views(const std::vector<CameraView>& views, const Coverage& coverage) {
  if (static_cast<int>(views.size()) < kMinCameraViews) {
    throw ConfigError(
        "only {} different usable views, {} are needed and 20 are good: show the board at more "
        "places, distances and tilts",
        views.size(), kMinCameraViews);
  }
  if (coverage.regions() < kMinRegions || coverage.span() < kMinSpan) {
    throw ConfigError(
        "the views leave too much of the image empty (corners span {:.0f} % of it, and miss {}): "
        "show the board there too",
        100 * coverage.span(), listed(coverage.missing_regions()));
  }
}

void check_fit(const CameraFit& fit, const Coverage& coverage) {
  const CameraModel& camera = fit.camera;
  const double tilt = coverage.largest_tilt() * kDegrees;
  if (tilt < kMinTilt) {
    throw ConfigError(
        "the board is nearly frontal in every view (at most {:.0f} degrees), so the focal length "
        "cannot be told from the distance: tilt it by 20 degrees and more, each way",
        tilt);
  }
  if (fit.rms_px > kMaxRms_px) {
    throw ConfigError(
        "no camera explains the views better than {:.2f} px: check that --board describes the "
        "board and that it is flat, and hold it still",
        fit.rms_px);
  }
  const double focal = std::max(fit.sigma[0] / camera.fx_px, fit.sigma[1] / camera.fy_px);
  if (!(focal < kFocalSigma) || !(std::max(fit.sigma[2], fit.sigma[3]) < kCentreSigma_px)) {
    throw ConfigError(
        "the views do not determine the camera: fx {:.1f} +- {:.1f} px, centre +- {:.1f} px "
        "(largest tilt {:.0f} degrees): show the board larger, sharper and tilted more, each way",
        camera.fx_px, fit.sigma[0], std::max(fit.sigma[2], fit.sigma[3]), tilt);
  }
  if (std::abs(camera.fx_px / camera.fy_px - 1) > kAspect) {
    throw ConfigError(
        "fx {:.1f} and fy {:.1f} px differ as no camera's do: check --board, and that its print "
        "was not stretched",
        camera.fx_px, camera.fy_px);
  }
  const double off_x = std::abs(camera.cx_px / (camera.width_px - 1) - 0.5);
  const double off_y = std::abs(camera.cy_px / (camera.height_px - 1) - 0.5);
  if (std::max(off_x, off_y) > kCentreOff) {
    throw ConfigError(
        "the optical axis would meet the image at ({:.0f}, {:.0f}) px, far from its middle: is the "
        "image cropped? Otherwise tilt the board more, each way",
        camera.cx_px, camera.cy_px);
  }
  if (!monotonic(camera)) {
    throw ConfigError(
        "the distortion found folds the image's corners over: show the board in the corners of the "
        "image too");
  }
}

}  // namespace tagwrench
