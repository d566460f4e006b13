// Room calibration/camera: pictures of a printed board -> the lens.
// In:  corners of the board, px of the camera's picture; the board's squares, m.
// Out: CameraModel: focal lengths and centre in px, OpenCV's distortion, with standard deviations.
// Then: board.h (finds the board).
// Uses OpenCV inside.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host/calibration/camera/board.h"
#include "host/tracker/camera_model.h"

namespace tagwrench {

/// What a calibration demands of its views.
constexpr int kMinCameraViews = 8;
constexpr int kMaxCameraViews = 80;

struct CameraView {
  std::string name;  ///< of the image, for people
  std::vector<BoardCorner> corners;
  double blur_px = 0;
};

/// Where the board was in one view, as far as the camera is known.
struct BoardPose {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the board, away from the lens, camera
                                                      ///< axes
  double distance = 1;                                ///< of its middle, in squares
};

/// A view in the light of the fit.
struct FittedView {
  double rms_px = 0;  ///< reprojection error; of a view that was dropped, against the final camera
  bool used = true;
  BoardPose pose;
};

struct CameraFit {
  CameraModel camera;
  std::array<double, 9> sigma{};  ///< one standard deviation: fx fy cx cy, k1 k2 p1 p2 k3
  double rms_px = 0;              ///< of all corners of the views used
  int used = 0;
  std::vector<FittedView> views;  ///< in the order of the input
};

/// Which parts of a camera calibration's evidence are there, and which are missing: regions of the
/// image, tilts of the board, distances.
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

/// Least squares on the reprojection error (OpenCV's calibrateCamera, after Zhang, "A flexible new
/// technique for camera calibration", PAMI 22, 2000), with fx fy cx cy k1 k2 p1 p2 free. k3 is free
/// only if that lowers the error of views that were held out of the fit. Views whose error stands
/// out from the others' (median and median absolute deviation) are dropped, worst first. Throws
/// ConfigError when more than a third would be dropped, or no camera fits.
CameraFit fit_camera(const std::vector<CameraView>& views, int width_px, int height_px);

/// Board poses through a rough camera: `f_px` and no distortion at first; once there are enough
/// views, a focal length of their own.
std::vector<BoardPose> rough_poses(const std::vector<CameraView>& views, int width_px,
                                   int height_px, double f_px);

/// Throws ConfigError with the reason and the remedy where the views cannot carry a calibration,
/// before (views) or after (fit) it is tried.
void check_views(const std::vector<CameraView>& views, const Coverage& coverage);
void check_fit(const CameraFit& fit, const Coverage& coverage);

// Takes views of the board by itself: when it is held still, sharp, and differs from those before.

enum class ViewResult : std::uint8_t {
  yes,
  moving,  ///< live only
  alike,   ///< as an earlier view
  no,      ///< see the look
};

class ViewCollector {
 public:
  /// `camera`: as sensor.yaml knows it so far. `live`: the frames are moments of one movement, and
  /// the board must rest for a view; else each image stands for itself.
  ViewCollector(const BoardSpec& board, const CameraModel& camera, bool live);

  /// `name` of the image, for people.
  ViewResult look(const ImageView& image, const std::string& name);

  const std::vector<CameraView>& views() const { return views_; }
  /// Of the image shown last.
  BoardView last_look() const { return last_look_; }
  bool mirrored() const { return finder_.mirrored(); }
  /// Of the last live image in which the board was found, flipped back if mirrored.
  const std::vector<BoardCorner>& last_corners() const { return previous_; }
  /// As given.
  const CameraModel& camera() const { return camera_; }
  /// Poses through what is known of the lens by now.
  Coverage coverage() const;

  /// Leaves at most so many, those that differ most from each other.
  void thin_out(int most);

  /// Throws ConfigError with the reason where no view, another board, or only one pose was found.
  void check() const;

 private:
  void keep(const ImageView& image);

  BoardSpec board_;
  CameraModel camera_;
  bool live_;
  BoardFinder finder_;
  std::vector<CameraView> views_;
  std::vector<BoardCorner> previous_;
  int still_frames_ = 0;
  BoardView last_look_ = BoardView::no_board;
  std::map<BoardView, int> looks_;
  int looked_ = 0, alike_ = 0;
  std::vector<std::vector<std::uint8_t>> undetected_;  ///< images in which the board was not found
};

/// Mean distance of the corners that both show (px); a large number if they share too few.
double difference_px(const std::vector<BoardCorner>& a, const std::vector<BoardCorner>& b);

}  // namespace tagwrench
