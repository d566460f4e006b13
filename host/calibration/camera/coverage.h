// Which parts of a camera calibration's evidence are there, and which are missing: regions of the
// image, tilts of the board, distances.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "host/calibration/camera/corners.h"

namespace tagwrench {

/// Where the board was in one view, as far as the camera is known.
struct BoardPose {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the board, away from the lens, camera
                                                      ///< axes
  double distance = 1;                                ///< of its middle, in squares
};

class Coverage {
 public:
  Coverage(int width_px, int height_px) : width_(width_px), height_(height_px) {}

  /// One view's corners, and its pose.
  void add(const std::vector<BoardCorner>& corners, const BoardPose& pose);

  /// Of the 3 x 3 regions of the image those that hold corners.
  int regions() const;
  /// What to show next, for people; empty when nothing is missing.
  std::vector<std::string> missing() const;
  /// The regions alone: "top left", "bottom".
  std::vector<std::string> missing_regions() const;
  /// Largest angle between the board's normal and the optical axis, rad.
  double largest_tilt() const { return largest_tilt_; }
  /// Part of the image's width and height that corners span, the smaller of both.
  double span() const;

 private:
  int width_;
  int height_;
  std::array<int, 9> corners_{};  ///< per region, reading order
  std::array<bool, 4> tilted_{};  ///< left, right, top, bottom edge nearer to the lens
  double largest_tilt_ = 0;
  double nearest_ = 0;
  double farthest_ = 0;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-1e9);
};

/// "a, b and c".
std::string listed(const std::vector<std::string>& words);

}  // namespace tagwrench
