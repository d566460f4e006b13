// Which parts of a camera calibration's evidence are there, and which are missing.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "host/calibration/camera/board.h"

namespace tagwrench {

/// Of the 3 x 3 regions of an image, in reading order.
constexpr std::array<const char*, 9> kRegionNames = {"top left",    "top",    "top right",
                                                     "left",        "middle", "right",
                                                     "bottom left", "bottom", "bottom right"};

/// Where the board was in one view, as far as the camera is known.
struct BoardPose {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the board, away from the lens, camera
                                                      ///< axes
  double distance = 1;                                ///< of its middle, in squares
};

/// Regions of the image, tilts of the board, distances.
class Coverage {
 public:
  Coverage(int width_px, int height_px) : width_(width_px), height_(height_px) {}

  /// One view's corners, and its pose.
  void add(const std::vector<BoardCorner>& corners, const BoardPose& pose);

  /// Of the 3 x 3 regions of the image those that hold corners.
  int regions() const { return 9 - static_cast<int>(missing_regions().size()); }
  /// What to show next, for people; empty when nothing is missing.
  std::vector<std::string> missing() const;
  /// The regions alone: "top left", "bottom".
  std::vector<std::string> missing_regions() const;
  /// Largest angle between the board's normal and the optical axis, rad.
  double largest_tilt() const { return largest_tilt_; }
  /// Part of the image's width and height that corners span, the smaller of both.
  double span() const;

 private:
  int width_, height_;
  std::array<int, 9> corners_{};  ///< per region, reading order
  std::array<bool, 4> tilted_{};  ///< left, right, top, bottom edge nearer to the lens
  double largest_tilt_ = 0, nearest_ = 0, farthest_ = 0;
  Eigen::AlignedBox2d corners_box_;  ///< px
};

}  // namespace tagwrench
