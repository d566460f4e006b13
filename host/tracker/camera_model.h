// The camera as calibration describes it: pinhole with OpenCV's five-coefficient distortion.
#pragma once

#include <array>

namespace tagwrench {

struct CameraModel {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 805.0;
  double fy_px = 805.0;
  double cx_px = 319.5;
  double cy_px = 239.5;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
  /// The image is flipped left to right, as many camera modules deliver it. All other parameters
  /// describe the image after it has been flipped back.
  bool mirrored = false;
  /// Of a rolling shutter, from the first row to the last, s. 0: all rows are exposed at once.
  double readout = 0;
};

}  // namespace tagwrench
