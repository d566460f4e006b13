#include "host/calibration/camera/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/robust_statistics.h"

namespace tagwrench {
namespace {

constexpr int kFixed = cv::CALIB_USE_QR;
constexpr int kMinForOwnFocal = 5;
constexpr std::size_t kMinForK3 = 10;
constexpr int kFolds = 5;
constexpr double kK3Gain = 0.98;       // of the held-out squared error
constexpr double kOutlierSpreads = 4;  // median absolute deviations, as standard deviations
constexpr double kOutlierRatio = 1.5;  // to the median
constexpr double kOutlierFloor_px = 0.03;
constexpr double kMaxDropped = 1.0 / 3;
constexpr double kCornerRatio = 8;           // to the median error of all corners
constexpr double kMaxCornersDropped = 0.15;  // of a view; beyond, the view is bad

/// The views' corners as OpenCV wants them; lengths in squares.
struct Points {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> image;

  void add(const std::vector<BoardCorner>& corners) {
    board.emplace_back();
    image.emplace_back();
    for (const BoardCorner& corner : corners) {
      const Eigen::Vector2f at = corner.board.cast<float>(), pixel = corner.pixel.cast<float>();
      board.back().emplace_back(at.x(), at.y(), 0.0F);
      image.back().emplace_back(pixel.x(), pixel.y());
    }
  }
};

using Corners = std::vector<std::vector<BoardCorner>>;  // of each view

Corners corners_of(const std::vector<CameraView>& views) {
  Corners out;
  for (const CameraView& view : views) out.push_back(view.corners);
  return out;
}

std::vector<std::size_t> every(const Corners& views) {
  std::vector<std::size_t> all(views.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

Eigen::Isometry3d pose_from(const cv::Mat& rotation, const cv::Mat& translation) {
  cv::Matx33d r;
  cv::Rodrigues(rotation, r);
  const cv::Matx31d t(translation);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.linear()(row, column) = r(row, column);
    pose.translation()[row] = t(row);
  }
  return pose;
}

BoardShape flat_board(const Corners& all) {
  Eigen::AlignedBox2d box;
  for (const std::vector<BoardCorner>& view : all)
    for (const BoardCorner& corner : view) box.extend(corner.board);
  BoardShape shape;
  shape.middle = box.center();
  shape.half = std::max(1.0, 0.5 * box.sizes().maxCoeff());
  return shape;
}

/// With a flat board. The standard deviations are not asked for: OpenCV up to 4.6 counts points in
/// them, not coordinates, and they come out 1.4 times too large and more.
CameraBundle flat_fit(const Corners& all, const std::vector<std::size_t>& which, cv::Size size,
                      int flags) {
  Points points;
  for (const std::size_t i : which) points.add(all[i]);
  cv::Mat matrix, distortion = cv::Mat::zeros(1, 5, CV_64F);
  std::vector<cv::Mat> rotations, translations;
  cv::calibrateCamera(points.board, points.image, size, matrix, distortion, rotations, translations,
                      flags | kFixed,
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-9));
  CameraBundle out;
  out.camera.width_px = size.width;
  out.camera.height_px = size.height;
  const cv::Matx33d m(matrix);
  out.camera.fx_px = m(0, 0);
  out.camera.fy_px = m(1, 1);
  out.camera.cx_px = m(0, 2);
  out.camera.cy_px = m(1, 2);
  std::copy_n(distortion.begin<double>(), 5, out.camera.distortion.begin());
  out.k3_free = (flags & cv::CALIB_FIX_K3) == 0;
  out.shape = flat_board(all);
  for (std::size_t i = 0; i < which.size(); ++i)
    out.views.push_back({all[which[i]], pose_from(rotations[i], translations[i])});
  return out;
}

CameraBundle solve(const Corners& all, const std::vector<std::size_t>& which, cv::Size size,
                   int flags) {
  CameraBundle out = flat_fit(all, which, size, flags);
  adjust(out);
  return out;
}

BoardPose pose_of(const PlacedView& view) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const BoardCorner& corner : view.corners)
    middle += corner.board / static_cast<double>(view.corners.size());
  BoardPose pose;
  pose.normal = view.camera_T_board.linear().col(2);
  if (pose.normal.z() < 0) pose.normal = -pose.normal;
  pose.distance = (view.camera_T_board * Eigen::Vector3d(middle.x(), middle.y(), 0)).norm();
  return pose;
}

/// The view alone, through a camera and with a board that are given.
FittedView place(const std::vector<BoardCorner>& corners, const CameraBundle& bundle) {
  const CameraModel& camera = bundle.camera;
  const cv::Matx33d matrix(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  Points points;
  points.add(corners);
  cv::Mat rotation, translation;
  cv::solvePnP(points.board[0], points.image[0], matrix, camera.distortion, rotation, translation,
               false, cv::SOLVEPNP_IPPE);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = bundle.shape.point(corners[i].board).cast<float>();
    points.board[0][i] = {point.x(), point.y(), point.z()};
  }
  cv::solvePnPRefineLM(points.board[0], points.image[0], matrix, camera.distortion, rotation,
                       translation);
  const PlacedView view{corners, pose_from(rotation, translation)};
  return {rms_px(bundle, view), false, pose_of(view)};
}

/// Position in `errors` of the one that stands out most; errors.size() if none does.
std::size_t outlier(const std::vector<double>& errors) {
  const double middle = median(errors);
  std::vector<double> off;
  for (const double e : errors) off.push_back(std::abs(e - middle));
  const double limit =
      std::max(kOutlierRatio * middle, middle + kOutlierSpreads * kMadToSigma * median(off)) +
      kOutlierFloor_px;
  const auto worst = std::max_element(errors.begin(), errors.end());
  return *worst > limit ? static_cast<std::size_t>(worst - errors.begin()) : errors.size();
}

/// Squared error (px^2) of views that the fit has not seen.
double held_out(const Corners& all, const std::vector<std::size_t>& which, cv::Size size,
                int flags) {
  double sum = 0;
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> train, test;
    for (std::size_t i = 0; i < which.size(); ++i)
      (static_cast<int>(i % kFolds) == fold ? test : train).push_back(which[i]);
    const CameraBundle bundle = solve(all, train, size, flags);
    for (const std::size_t i : test) {
      const double rms = place(all[i], bundle).rms_px;
      sum += rms * rms * static_cast<double>(all[i].size());
    }
  }
  return sum;
}

/// Takes out single corners that stand out, from views that are good otherwise; whether there were
/// any.
bool drop_corners(Corners& all, const std::vector<std::size_t>& which, const CameraBundle& bundle) {
  std::vector<std::vector<double>> errors;
  std::vector<double> every;
  for (const PlacedView& view : bundle.views) {
    errors.push_back(errors_px(bundle, view));
    every.insert(every.end(), errors.back().begin(), errors.back().end());
  }
  const double limit_px = kCornerRatio * median(every) + kOutlierFloor_px;
  bool any = false;
  for (std::size_t i = 0; i < which.size(); ++i) {
    std::vector<BoardCorner>& view = all[which[i]];
    const auto off = static_cast<std::size_t>(
        std::count_if(errors[i].begin(), errors[i].end(), [&](double e) { return e > limit_px; }));
    if (off == 0 || off > kMaxCornersDropped * static_cast<double>(errors[i].size())) continue;
    std::vector<BoardCorner> kept;
    for (std::size_t c = 0; c < view.size(); ++c)
      if (errors[i][c] <= limit_px) kept.push_back(view[c]);
    view = kept;
    any = true;
  }
  return any;
}

double rms_px(const CameraBundle& bundle) {
  double squares = 0;
  std::size_t corners = 0;
  for (const PlacedView& view : bundle.views) {
    squares += std::pow(rms_px(bundle, view), 2) * static_cast<double>(view.corners.size());
    corners += view.corners.size();
  }
  return std::sqrt(squares / static_cast<double>(corners));
}

/// The least number of views that may be used.
double fewest(std::size_t views) { return (1 - kMaxDropped) * static_cast<double>(views); }

/// The fit without the corners and the views that stand out; `which` is left with those used.
CameraBundle solve_robustly(Corners& all, std::vector<std::size_t>& which, cv::Size size,
                            int flags) {
  for (;;) {
    CameraBundle bundle = solve(all, which, size, flags);
    if (drop_corners(all, which, bundle)) continue;
    std::vector<double> errors;
    for (const PlacedView& view : bundle.views) errors.push_back(rms_px(bundle, view));
    const std::size_t worst = outlier(errors);
    if (worst == errors.size()) return bundle;
    which.erase(which.begin() + static_cast<std::ptrdiff_t>(worst));
    if (static_cast<double>(which.size()) < fewest(all.size()))
      return solve(all, which, size, flags);
  }
}

CameraFit result(const CameraBundle& bundle, const Corners& all,
                 const std::vector<std::size_t>& used) {
  CameraFit fit;
  fit.camera = bundle.camera;
  fit.uncertainty = lens_uncertainty(bundle);
  fit.bow = bundle.shape.bow.norm() * bundle.shape.half;
  fit.rms_px = rms_px(bundle);
  fit.used = static_cast<int>(used.size());
  for (const std::vector<BoardCorner>& view : all) fit.views.push_back(place(view, bundle));
  for (std::size_t i = 0; i < used.size(); ++i) {
    const PlacedView& view = bundle.views[i];
    fit.views[used[i]] = {rms_px(bundle, view), true, pose_of(view)};
  }
  return fit;
}

constexpr double kMinSpan = 1.0 / 3;    // of width and height
constexpr double kMinTilt = 12;         // degrees
constexpr double kFocalSigma = 0.01;    // of it: what `calibrate target` refuses as wrong
constexpr double kMiddleSigma = 0.005;  // of the width: as much there
constexpr double kMaxRms_px = 1.0;
constexpr double kAspect = 0.1;      // of 1
constexpr double kCentreOff = 0.25;  // of width and height, from the middle
constexpr double kDegrees = 180 / std::numbers::pi;

/// Whether the lens model still maps larger angles to larger radii at the image's farthest corner.
bool monotonic(const CameraModel& camera) {
  const double x = std::max(camera.cx_px, camera.width_px - 1 - camera.cx_px) / camera.fx_px;
  const double y = std::max(camera.cy_px, camera.height_px - 1 - camera.cy_px) / camera.fy_px;
  const double farthest = std::hypot(x, y);
  const double k1 = camera.distortion[0], k2 = camera.distortion[1];
  const double k3 = camera.distortion[4];
  double reached = 0;
  for (double r = 0; reached < farthest; r += 0.01 * farthest) {
    const double r2 = r * r;
    if (1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) <= 0) return false;
    reached = r * (1 + r2 * (k1 + r2 * (k2 + r2 * k3)));
    if (r > 3 * farthest) return false;
  }
  return true;
}

}  // namespace

CameraFit fit_camera(const std::vector<CameraView>& views, int width_px, int height_px) {
  const cv::Size size(width_px, height_px);
  Corners all = corners_of(views);
  std::vector<std::size_t> used = every(all);
  try {
    CameraBundle bundle = solve_robustly(all, used, size, cv::CALIB_FIX_K3);
    if (used.size() >= kMinForK3 &&
        held_out(all, used, size, 0) < kK3Gain * held_out(all, used, size, cv::CALIB_FIX_K3))
      bundle = solve(all, used, size, 0);
    return result(bundle, all, used);
  } catch (const cv::Exception& e) {
    throw ConfigError(
        "no camera fits the views ({}): show the board tilted, and at different places and "
        "distances",
        e.err);
  }
}

std::vector<BoardPose> rough_poses(const std::vector<CameraView>& views, int width_px,
                                   int height_px, double f_px) {
  const Corners all = corners_of(views);
  CameraBundle bundle;
  bundle.camera = {width_px, height_px, f_px, f_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
  std::vector<BoardPose> out;
  try {
    if (static_cast<int>(all.size()) >= kMinForOwnFocal) {
      const CameraBundle own =
          flat_fit(all, every(all), {width_px, height_px},
                   cv::CALIB_FIX_PRINCIPAL_POINT | cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K2 |
                       cv::CALIB_FIX_K3);
      const double ratio = own.camera.fx_px / f_px;
      if (ratio > 0.3 && ratio < 3) bundle.camera = own.camera;
    }
    for (const std::vector<BoardCorner>& view : all) out.push_back(place(view, bundle).pose);
  } catch (const cv::Exception&) {
    // Too little to go by yet: as if the board were seen from the front.
    out.assign(views.size(), BoardPose{});
  }
  return out;
}

void check_fit(const CameraFit& fit, const Coverage& coverage) {
  const CameraModel& camera = fit.camera;
  const auto& sigma = fit.uncertainty.sigma;
  const double tilt = coverage.largest_tilt() * kDegrees;
  if (fit.used < fewest(fit.views.size())) {
    throw ConfigError(
        "more than a third of the {} views contradict the others (reprojection error of those "
        "{:.2f} "
        "px): check that --board describes the board and that it is flat and stiff, and hold it "
        "still",
        fit.views.size(), fit.rms_px);
  }
  if (coverage.span() < kMinSpan) {
    throw ConfigError(
        "the views leave too much of the image empty (corners span {:.0f} % of it, and miss {}): "
        "show the board there too",
        100 * coverage.span(), listed(coverage.missing_regions()));
  }
  if (tilt < kMinTilt) {
    throw ConfigError(
        "the board is nearly frontal in every view (at most {:.0f} degrees), so the focal length "
        "cannot be told from the distance: tilt it by 20 degrees and more, each way",
        tilt);
  }
  if (fit.rms_px > kMaxRms_px) {
    throw ConfigError(
        "no camera explains the views better than {:.2f} px: check that --board describes the "
        "board and that it is flat, and hold it still",
        fit.rms_px);
  }
  const double focal = std::max(sigma[0] / camera.fx_px, sigma[1] / camera.fy_px);
  const double middle_px = fit.uncertainty.regions_px[4];
  if (!(focal < kFocalSigma) || !(middle_px < kMiddleSigma * camera.width_px)) {
    throw ConfigError(
        "the views do not determine the camera: fx {:.1f} +- {:.1f} px ({:.2g} %, {:.2g} % are "
        "needed), {:.1f} px in the middle of the picture: {}",
        camera.fx_px, sigma[0], 100 * focal, 100 * kFocalSigma, middle_px,
        fit.uncertainty.views_agree()
            ? "show the board larger, sharper and tilted more, each way, and more often"
            : "they contradict each other by more than their corners' noise; hold a flat, stiff "
              "board still, and lock the focus");
  }
  if (std::abs(camera.fx_px / camera.fy_px - 1) > kAspect) {
    throw ConfigError(
        "fx {:.1f} and fy {:.1f} px differ as no camera's do: check --board, and that its print "
        "was not stretched",
        camera.fx_px, camera.fy_px);
  }
  const double off_x = std::abs(camera.cx_px / (camera.width_px - 1) - 0.5);
  const double off_y = std::abs(camera.cy_px / (camera.height_px - 1) - 0.5);
  if (std::max(off_x, off_y) > kCentreOff) {
    throw ConfigError(
        "the optical axis would meet the image at ({:.0f}, {:.0f}) px, far from its middle: is the "
        "image cropped? Otherwise tilt the board more, each way",
        camera.cx_px, camera.cy_px);
  }
  if (!monotonic(camera)) {
    throw ConfigError(
        "the distortion found folds the image's corners over: show the board in the corners of the "
        "image too");
  }
}

}  // namespace tagwrench
