#include "host/calibration/target/keyframes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/tracker/projection.h"

namespace tagwrench {
namespace {

constexpr double kMargin_px = 16.0;      // profiles reach 6 px, and the pose may be a pixel off
constexpr double kSpacingGrowth = 1.25;  // each time the set is full

/// How different two displacements are, m: a rotation counts by what it moves at the distance of
/// the lens.
double distance(const Vector6& a, const Vector6& b) {
  constexpr double kLever = 20e-3;  // m
  const Vector6 d = a - b;
  return std::sqrt(d.head<3>().squaredNorm() + kLever * kLever * d.tail<3>().squaredNorm());
}

}  // namespace

Keyframe cropped(const ImageView& image, const CameraModel& camera,
                 const std::vector<Eigen::Vector3d>& points_camera) {
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  for (const Eigen::Vector3d& p : points_camera) {
    const ProjectedPoint projected = project(camera, p);
    if (!projected.valid || !projected.pixel.allFinite()) continue;
    low = low.min(projected.pixel.array());
    high = high.max(projected.pixel.array());
  }
  const Eigen::Array2d last(image.width - 1, image.height - 1);
  low = (low - kMargin_px).floor().max(0.0);
  high = (high + kMargin_px).ceil().min(last);
  Keyframe frame;
  frame.camera = camera;
  if (!(low <= high).all()) return frame;
  const int x0 = static_cast<int>(low.x());
  const int y0 = static_cast<int>(low.y());
  const int width = static_cast<int>(high.x()) - x0 + 1;
  const int height = static_cast<int>(high.y()) - y0 + 1;
  frame.camera.width_px = width;
  frame.camera.height_px = height;
  frame.camera.cx_px -= x0;
  frame.camera.cy_px -= y0;
  frame.camera.mirrored = false;
  frame.first_row = y0;
  frame.image_rows = image.height;
  frame.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  auto to = frame.pixels.begin();
  for (int row = y0; row < y0 + height; ++row) {
    const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    if (camera.mirrored) {
      to = std::reverse_copy(from + image.width - x0 - width, from + image.width - x0, to);
    } else {
      to = std::copy(from + x0, from + x0 + width, to);
    }
  }
  return frame;
}

bool KeyframeSet::wants(const Vector6& displacement) const {
  return std::none_of(frames_.begin(), frames_.end(), [&](const Keyframe& kept) {
    return distance(kept.displacement, displacement) < spacing_;
  });
}

void KeyframeSet::add(Keyframe frame) {
  frames_.push_back(std::move(frame));
  while (frames_.size() > capacity_) {
    spacing_ *= kSpacingGrowth;
    std::vector<Keyframe> all;
    all.swap(frames_);
    for (Keyframe& kept : all) {
      if (wants(kept.displacement)) frames_.push_back(std::move(kept));
    }
  }
}

}  // namespace tagwrench
