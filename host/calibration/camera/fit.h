// Room calibration/camera: pictures of a printed board -> the lens.
// In:  corners of the board, px of the camera's picture; the board's squares, m.
// Out: CameraModel: focal lengths and centre in px, OpenCV's distortion, with standard deviations.
// Then: board.h (finds the board), collect.h (takes the views), coverage.h (what they show).
// Uses OpenCV inside.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/camera/board.h"
#include "host/calibration/camera/bundle.h"
#include "host/calibration/camera/coverage.h"
#include "host/tracker/camera_model.h"

namespace tagwrench {

/// What a calibration demands of its views.
constexpr int kMinCameraViews = 8;
constexpr int kMaxCameraViews = 80;

struct CameraView {
  std::string name;  ///< of the image, for people
  std::vector<BoardCorner> corners;
  CornerView look;
};

/// A view in the light of the fit.
struct FittedView {
  double rms_px = 0;  ///< reprojection error; of a view that was dropped, against the final camera
  bool used = true;
  BoardPose pose;
};

struct CameraFit {
  CameraModel camera;
  LensUncertainty uncertainty;
  double bow = 0;     ///< of the board: its edge beside its middle, over half its length
  double rms_px = 0;  ///< of all corners of the views used
  int used = 0;
  std::vector<FittedView> views;  ///< in the order of the input
};

/// Least squares on the reprojection error (begun with OpenCV's calibrateCamera, after Zhang, "A
/// flexible new technique for camera calibration", PAMI 22, 2000), with fx fy cx cy k1 k2 p1 p2 and
/// the board's bow free. k3 is free only if that lowers the error of views that were held out of
/// the fit. Views whose error stands out from the others' (median and median absolute deviation)
/// are dropped, worst first, until more than a third are. Throws ConfigError when no camera fits.
CameraFit fit_camera(const std::vector<CameraView>& views, int width_px, int height_px);

/// Board poses through a rough camera: `f_px` and no distortion at first; once there are enough
/// views, a focal length of their own.
std::vector<BoardPose> rough_poses(const std::vector<CameraView>& views, int width_px,
                                   int height_px, double f_px);

/// Throws ConfigError with the reason and the remedy where the views cannot carry a calibration.
/// `coverage` of the views that were used.
void check_fit(const CameraFit& fit, const Coverage& coverage);

}  // namespace tagwrench
