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

/// One view's corners as OpenCV wants them; lengths in squares.
struct Points {
  std::vector<cv::Point3f> board;
  std::vector<cv::Point2f> image;
};

std::vector<Points> points(const std::vector<CameraView>& views) {
  std::vector<Points> out(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (const BoardCorner& corner : views[i].corners) {
      const Eigen::Vector2f board = corner.board.cast<float>(), pixel = corner.pixel.cast<float>();
      out[i].board.emplace_back(board.x(), board.y(), 0.0F);
      out[i].image.emplace_back(pixel.x(), pixel.y());
    }
  }
  return out;
}

std::vector<std::size_t> every(const std::vector<Points>& views) {
  std::vector<std::size_t> all(views.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

struct Solution {
  cv::Matx33d matrix = cv::Matx33d::eye();
  cv::Mat distortion = cv::Mat::zeros(1, 5, CV_64F);
  std::vector<cv::Mat> rotations, translations;
  cv::Mat sigma;     ///< of the intrinsics
  cv::Mat view_rms;  ///< px
  double rms_px = 0;
};

Solution solve(const std::vector<Points>& all, const std::vector<std::size_t>& which, cv::Size size,
               int flags) {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> image;
  for (const std::size_t i : which) {
    board.push_back(all[i].board);
    image.push_back(all[i].image);
  }
  Solution out;
  cv::Mat matrix, extrinsic_sigma;
  out.rms_px = cv::calibrateCamera(
      board, image, size, matrix, out.distortion, out.rotations, out.translations, out.sigma,
      extrinsic_sigma, out.view_rms, flags | kFixed,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12));
  out.matrix = cv::Matx33d(matrix);
  return out;
}

BoardPose pose_of(const Points& view, const cv::Mat& rotation, const cv::Mat& translation) {
  cv::Matx33d r;
  cv::Rodrigues(rotation, r);
  const cv::Matx31d t(translation);
  cv::Point3d middle(0, 0, 0);
  for (const cv::Point3f& p : view.board) middle += cv::Point3d(p);
  middle *= 1.0 / static_cast<double>(view.board.size());
  const cv::Matx31d centre = r * cv::Matx31d(middle.x, middle.y, 0) + t;
  BoardPose pose;
  pose.normal = {r(0, 2), r(1, 2), r(2, 2)};
  if (pose.normal.z() < 0) pose.normal = -pose.normal;
  pose.distance = cv::norm(centre);
  return pose;
}

/// The view alone, through a camera that is given.
FittedView place(const Points& view, const cv::Matx33d& matrix, const cv::Mat& distortion) {
  cv::Mat rotation, translation;
  cv::solvePnP(view.board, view.image, matrix, distortion, rotation, translation, false,
               cv::SOLVEPNP_IPPE);
  cv::solvePnPRefineLM(view.board, view.image, matrix, distortion, rotation, translation);
  std::vector<cv::Point2f> projected;
  cv::projectPoints(view.board, rotation, translation, matrix, distortion, projected);
  const double error = cv::norm(projected, view.image, cv::NORM_L2);
  return {error / std::sqrt(static_cast<double>(view.image.size())), false,
          pose_of(view, rotation, translation)};
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
double held_out(const std::vector<Points>& all, const std::vector<std::size_t>& which,
                cv::Size size, int flags) {
  double sum = 0;
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> train, test;
    for (std::size_t i = 0; i < which.size(); ++i)
      (static_cast<int>(i % kFolds) == fold ? test : train).push_back(which[i]);
    const Solution s = solve(all, train, size, flags);
    for (const std::size_t i : test) {
      const double rms = place(all[i], s.matrix, s.distortion).rms_px;
      sum += rms * rms * static_cast<double>(all[i].image.size());
    }
  }
  return sum;
}

/// Takes out single corners that stand out, from views that are good otherwise; whether there were
/// any.
bool drop_corners(std::vector<Points>& all, const std::vector<std::size_t>& which,
                  const Solution& s) {
  std::vector<std::vector<double>> errors;
  std::vector<double> every;
  for (std::size_t i = 0; i < which.size(); ++i) {
    const Points& view = all[which[i]];
    std::vector<cv::Point2f> projected;
    cv::projectPoints(view.board, s.rotations[i], s.translations[i], s.matrix, s.distortion,
                      projected);
    std::vector<double>& of_view = errors.emplace_back();
    for (std::size_t c = 0; c < projected.size(); ++c)
      of_view.push_back(cv::norm(projected[c] - view.image[c]));
    every.insert(every.end(), of_view.begin(), of_view.end());
  }
  const double limit_px = kCornerRatio * median(every) + kOutlierFloor_px;
  bool any = false;
  for (std::size_t i = 0; i < which.size(); ++i) {
    Points& view = all[which[i]];
    const auto off = static_cast<std::size_t>(
        std::count_if(errors[i].begin(), errors[i].end(), [&](double e) { return e > limit_px; }));
    if (off == 0 || off > kMaxCornersDropped * static_cast<double>(errors[i].size())) continue;
    Points kept;
    for (std::size_t c = 0; c < errors[i].size(); ++c) {
      if (errors[i][c] > limit_px) continue;
      kept.board.push_back(view.board[c]);
      kept.image.push_back(view.image[c]);
    }
    view = kept;
    any = true;
  }
  return any;
}

/// The fit without the corners and the views that stand out; `which` is left with those used.
Solution solve_robustly(std::vector<Points>& all, std::vector<std::size_t>& which, cv::Size size,
                        int flags) {
  const double fewest = (1 - kMaxDropped) * static_cast<double>(all.size());
  for (;;) {
    Solution solution = solve(all, which, size, flags);
    if (drop_corners(all, which, solution)) continue;
    std::vector<double> errors(solution.view_rms.begin<double>(), solution.view_rms.end<double>());
    const std::size_t worst = outlier(errors);
    if (worst == errors.size()) return solution;
    which.erase(which.begin() + static_cast<std::ptrdiff_t>(worst));
    if (static_cast<double>(which.size()) < fewest) {
      throw ConfigError(
          "more than a third of the {} views contradict the others (reprojection error {:.2f} px): "
          "check that --board describes the board and that it is flat and stiff, and hold it still",
          all.size(), solution.rms_px);
    }
  }
}

CameraFit result(const Solution& s, const std::vector<Points>& all,
                 const std::vector<std::size_t>& used, cv::Size size) {
  CameraFit fit;
  fit.camera.width_px = size.width;
  fit.camera.height_px = size.height;
  fit.camera.fx_px = s.matrix(0, 0);
  fit.camera.fy_px = s.matrix(1, 1);
  fit.camera.cx_px = s.matrix(0, 2);
  fit.camera.cy_px = s.matrix(1, 2);
  std::copy_n(s.distortion.begin<double>(), 5, fit.camera.distortion.begin());
  std::copy_n(s.sigma.begin<double>(), fit.sigma.size(), fit.sigma.begin());
  fit.rms_px = s.rms_px;
  fit.used = static_cast<int>(used.size());
  for (const Points& view : all) fit.views.push_back(place(view, s.matrix, s.distortion));
  for (std::size_t i = 0; i < used.size(); ++i) {
    fit.views[used[i]] = {s.view_rms.at<double>(static_cast<int>(i)), true,
                          pose_of(all[used[i]], s.rotations[i], s.translations[i])};
  }
  return fit;
}

constexpr int kMinRegions = 6;         // of nine
constexpr double kMinSpan = 0.6;       // of width and height
constexpr double kMinTilt = 12;        // degrees
constexpr double kFocalSigma = 0.003;  // of the focal length
constexpr double kCentreSigma_px = 5;
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
  std::vector<Points> all = points(views);
  std::vector<std::size_t> used = every(all);
  try {
    Solution solution = solve_robustly(all, used, size, cv::CALIB_FIX_K3);
    if (used.size() >= kMinForK3 &&
        held_out(all, used, size, 0) < kK3Gain * held_out(all, used, size, cv::CALIB_FIX_K3))
      solution = solve(all, used, size, 0);
    return result(solution, all, used, size);
  } catch (const cv::Exception& e) {
    throw ConfigError(
        "no camera fits the views ({}): show the board tilted, and at different places and "
        "distances",
        e.err);
  }
}

std::vector<BoardPose> rough_poses(const std::vector<CameraView>& views, int width_px,
                                   int height_px, double f_px) {
  const std::vector<Points> all = points(views);
  cv::Matx33d matrix(f_px, 0, 0.5 * (width_px - 1), 0, f_px, 0.5 * (height_px - 1), 0, 0, 1);
  cv::Mat distortion = cv::Mat::zeros(1, 5, CV_64F);
  std::vector<BoardPose> out;
  try {
    if (static_cast<int>(all.size()) >= kMinForOwnFocal) {
      const Solution s = solve(all, every(all), {width_px, height_px},
                               cv::CALIB_FIX_PRINCIPAL_POINT | cv::CALIB_ZERO_TANGENT_DIST |
                                   cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3);
      const double ratio = s.matrix(0, 0) / f_px;
      if (ratio > 0.3 && ratio < 3) {
        matrix = s.matrix;
        distortion = s.distortion;
      }
    }
    for (const Points& view : all) out.push_back(place(view, matrix, distortion).pose);
  } catch (const cv::Exception&) {
    // Too little to go by yet: as if the board were seen from the front.
    out.assign(views.size(), BoardPose{});
  }
  return out;
}

void check_views(const std::vector<CameraView>& views, const Coverage& coverage) {
  if (static_cast<int>(views.size()) < kMinCameraViews) {
    throw ConfigError(
        "only {} different usable views, {} are needed and 20 are good: show the board at more "
        "places, distances and tilts",
        views.size(), kMinCameraViews);
  }
  if (coverage.regions() < kMinRegions || coverage.span() < kMinSpan) {
    throw ConfigError(
        "the views leave too much of the image empty (corners span {:.0f} % of it, and miss {}): "
        "show the board there too",
        100 * coverage.span(), listed(coverage.missing_regions()));
  }
}

void check_fit(const CameraFit& fit, const Coverage& coverage) {
  const CameraModel& camera = fit.camera;
  const double tilt = coverage.largest_tilt() * kDegrees;
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
  const double focal = std::max(fit.sigma[0] / camera.fx_px, fit.sigma[1] / camera.fy_px);
  if (!(focal < kFocalSigma) || !(std::max(fit.sigma[2], fit.sigma[3]) < kCentreSigma_px)) {
    throw ConfigError(
        "the views do not determine the camera: fx {:.1f} +- {:.1f} px, centre +- {:.1f} px "
        "(largest tilt {:.0f} degrees): show the board larger, sharper and tilted more, each way",
        camera.fx_px, fit.sigma[0], std::max(fit.sigma[2], fit.sigma[3]), tilt);
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
