#include "host/calibration/camera/coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/count_text.h"

namespace tagwrench {
namespace {

constexpr int kMinCorners = 6;                         // in a region
constexpr double kTilt = 20 * std::numbers::pi / 180;  // asked for, each way
constexpr double kDistanceRatio = 1.2;                 // farthest to nearest
constexpr std::array<const char*, 4> kEdges = {"left", "right", "top", "bottom"};

}  // namespace

void Coverage::add(const std::vector<BoardCorner>& corners, const BoardPose& pose) {
  for (const BoardCorner& corner : corners) {
    const int column = std::clamp(static_cast<int>(3 * (corner.pixel.x() + 0.5) / width_), 0, 2);
    const int row = std::clamp(static_cast<int>(3 * (corner.pixel.y() + 0.5) / height_), 0, 2);
    ++corners_[3 * row + column];
    corners_box_.extend(corner.pixel);
  }
  // Where the normal leans to x, the plane comes nearer there.
  const Eigen::Vector3d& n = pose.normal;
  const double x = std::atan2(n.x(), n.z()), y = std::atan2(n.y(), n.z());
  tilted_[0] |= x <= -kTilt;
  tilted_[1] |= x >= kTilt;
  tilted_[2] |= y <= -kTilt;
  tilted_[3] |= y >= kTilt;
  largest_tilt_ = std::max(largest_tilt_, std::acos(std::clamp(n.z(), -1.0, 1.0)));
  nearest_ = nearest_ == 0 ? pose.distance : std::min(nearest_, pose.distance);
  farthest_ = std::max(farthest_, pose.distance);
}

std::vector<std::string> Coverage::missing_regions() const {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < corners_.size(); ++i)
    if (corners_[i] < kMinCorners) out.emplace_back(kRegionNames[i]);
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
  if (corners_box_.isEmpty()) return 0;
  return corners_box_.sizes().cwiseQuotient(Eigen::Vector2d(width_, height_)).minCoeff();
}

}  // namespace tagwrench
