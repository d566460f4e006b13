// Views of a board, adjusted together: the lens, where each view's board was, and the board's
// shape, by one least-squares fit; and how well the views determine the lens.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "host/calibration/camera/board.h"
#include "host/tracker/camera_model.h"

namespace tagwrench {

/// What a sheet on a support does: it bows and twists. A bow of a hundredth of the board's length
/// that is taken for flat costs the focal length one percent.
struct BoardShape {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< in squares, as all lengths here
  Eigen::Vector3d bow = Eigen::Vector3d::Zero();     ///< z = bow . (x^2, x y, y^2) from the middle
  double half = 1;                                   ///< from the middle to the farther edge

  Eigen::Vector3d point(const Eigen::Vector2d& board) const {
    const Eigen::Vector2d d = board - middle;
    return {board.x(), board.y(),
            bow.dot(Eigen::Vector3d(d.x() * d.x(), d.x() * d.y(), d.y() * d.y()))};
  }
};

/// A view and where its board is.
struct PlacedView {
  std::vector<BoardCorner> corners;
  Eigen::Isometry3d camera_T_board = Eigen::Isometry3d::Identity();
};

struct CameraBundle {
  CameraModel camera;
  bool k3_free = false;  ///< else it stays as it is
  BoardShape shape;
  std::vector<PlacedView> views;
};

/// Root of the mean squared reprojection error of a view, px; and of each of its corners.
double rms_px(const CameraBundle& bundle, const PlacedView& view);
std::vector<double> errors_px(const CameraBundle& bundle, const PlacedView& view);

/// From near the minimum to it (Levenberg-Marquardt, the poses eliminated). The shape is held
/// towards flat by what a support does: 1 % of half the board's length, one standard deviation.
void adjust(CameraBundle& bundle);

/// fx fy cx cy (px), k1 k2 p1 p2 k3: the order of what follows.
constexpr int kLensTerms = 9;

struct LensUncertainty {
  /// Standard deviations; infinite where the views do not tell, 0 of a k3 that was not free.
  std::array<double, kLensTerms> sigma{};
  double noise_px = 0;  ///< standard deviation of a corner's coordinate within its view
  /// By how much more the views contradict each other than that noise explains, as a ratio of
  /// variances; 1: not at all. Already in sigma.
  double contradiction = 1;
  bool views_agree() const { return contradiction < 2; }
  /// Of the 3 x 3 regions of the image, in reading order: how far a direction may be off there, px,
  /// one standard deviation at the worst place of the region. A turn of the whole camera is free:
  /// the board's poses take it up.
  std::array<double, 9> regions_px{};
};

/// First order, at the minimum. Each view's pose is eliminated, which leaves its normal equations
/// A_v for lens and shape and its pull b_v = J^T r; then
///   covariance = s^2 F (sum A_v)^-1,
///   F = [sum b_v^T A_v^+ b_v / (sum rank A_v - terms)] / s^2,
/// with s^2 from what is left when each view may have a lens of its own: the F test of one lens for
/// all. Where views contradict each other by more than the corners' noise (motion, a lens that
/// refocuses), F counts them as what they are: a few views, not hundreds of independent corners. F
/// is never taken for less than 1; and a variance not for less than that of the jackknife over
/// views, for what pulls one term more than others. regions_px count a k3 that was held as unknown
/// by 1, since what was not fitted may be there where no corners are.
LensUncertainty lens_uncertainty(const CameraBundle& bundle);

}  // namespace tagwrench
