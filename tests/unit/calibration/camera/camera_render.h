// Pictures of a board through a lens: high-resolution art, looked up along the ray of every
// subpixel. Shares nothing with the calibration but the definition of the lens model.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "host/calibration/print/board_spec.h"
#include "host/core/types.h"

namespace tagwrench::test {

struct Lens {
  int width = 640;
  int height = 480;
  double fx = 801.3;
  double fy = 803.1;
  double cx = 326.4;
  double cy = 234.7;
  double k1 = -0.21;
  double k2 = 0.11;
  double p1 = 0.0009;
  double p2 = -0.0006;
  double k3 = 0;

  /// Pixel of a point at (x, y, 1).
  cv::Point2d project(double x, double y) const;
};

/// Where the board's middle is, in squares, camera axes, and how it is turned.
struct Placement {
  cv::Vec3d rotation;  ///< rotation vector, rad
  cv::Vec3d middle;
};

struct Conditions {
  double blur_px = 1.0;
  double noise = 2.0;  ///< grey levels
  double black = 35;
  double white = 205;
  double bend = 0;  ///< z = bend x^2, squares
  cv::Point2d smear_px{0, 0};
};

class BoardRenderer {
 public:
  BoardRenderer(const BoardSpec& board, const Lens& lens);
  cv::Mat render(const Placement& placement, std::uint64_t seed,
                 const Conditions& conditions = {}) const;

 private:
  BoardSpec board_;
  Lens lens_;
  cv::Mat art_;                    ///< 0..1
  std::vector<cv::Point2d> rays_;  ///< at z = 1, of the subpixels in reading order
};

/// So many placements that cover the image, with tilts of `tilt` radians all round.
std::vector<Placement> good_placements(const Lens& lens, int count, double tilt,
                                       std::uint64_t seed = 1);

ImageView view_of(const cv::Mat& image);

}  // namespace tagwrench::test
