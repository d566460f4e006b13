// The pictures that a calibration of the target works on: few, well spread over the motion, cropped
// to the tags.
#pragma once

#include <vector>

#include "host/tracker/edge_measure.h"

namespace tagwrench {

/// One picture of the moved target, flipped back where the camera mirrors it.
struct Keyframe {
  Vector6 displacement = Vector6::Zero();  ///< from rest, as tracked: m, rad (types.h)
  Vector6 velocity = Vector6::Zero();      ///< m/s, rad/s along the camera's axes
  int first_row = 0;                       ///< of the crop in the image
  int image_rows = 1;                      ///< of the whole image
  CameraModel camera;                ///< of the crop: the principal point counts from its corner
  std::vector<std::uint8_t> pixels;  ///< no padding

  PixelView<std::uint8_t> view() const {
    return {pixels.data(), camera.width_px, camera.height_px, camera.width_px};
  }
};

/// The part of `image` (as the camera delivers it) that shows the points, with a margin for the
/// profiles across edges. Empty pixels where it shows none of them.
Keyframe cropped(const ImageView& image, const CameraModel& camera,
                 const std::vector<Eigen::Vector3d>& points_camera);

/// Keeps at most `capacity` pictures that differ in displacement by as much as there is room for.
class KeyframeSet {
 public:
  explicit KeyframeSet(std::size_t capacity) : capacity_(capacity) {}

  /// Worth cropping: far enough from all that are kept.
  bool wants(const Vector6& displacement) const;
  void add(Keyframe frame);

  const std::vector<Keyframe>& frames() const noexcept { return frames_; }

 private:
  static constexpr double kFirstSpacing = 5e-6;  // m, see distance()

  std::size_t capacity_;
  double spacing_ = kFirstSpacing;
  std::vector<Keyframe> frames_;
};

}  // namespace tagwrench
