// Whether a camera calibration is as wrong as it says it may be: many calibrations of one lens.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "host/calibration/camera/fit.h"
#include "tests/unit/calibration/camera/camera_render.h"

namespace tagwrench::test {
namespace {

constexpr int kColumns = 9, kRows = 6;  // squares
constexpr double kNoise_px = 0.1;

struct Trial {
  int views = 16;
  double tilt = 0.5;    ///< rad
  double bend = 0;      ///< z = bend x^2, squares
  double shear_px = 0;  ///< of a view, from the image's top to its bottom: it was moved
};

/// Corners where the lens puts them, each with noise of its own.
std::vector<CameraView> views(const Trial& trial, std::uint64_t seed) {
  const Lens lens;
  cv::RNG random(seed);
  std::vector<CameraView> out;
  for (const Placement& p : good_placements(lens, trial.views, trial.tilt, seed)) {
    cv::Matx33d r;
    cv::Rodrigues(p.rotation, r);
    const double shear = random.gaussian(trial.shear_px) / lens.height;
    CameraView& view = out.emplace_back();
    for (int row = 1; row < kRows; ++row) {
      for (int column = 1; column < kColumns; ++column) {
        const double x = column - 0.5 * kColumns, y = row - 0.5 * kRows;
        const cv::Vec3d at = r * cv::Vec3d(x, y, trial.bend * x * x) + p.middle;
        cv::Point2d pixel = lens.project(at[0] / at[2], at[1] / at[2]);
        pixel.x += shear * pixel.y;
        if (pixel.x < 5 || pixel.y < 5 || pixel.x > lens.width - 6 || pixel.y > lens.height - 6)
          continue;
        view.corners.push_back(
            {{column, row},
             {pixel.x + random.gaussian(kNoise_px), pixel.y + random.gaussian(kNoise_px)}});
      }
    }
  }
  return out;
}

/// Mean square of errors over what they were said to be.
struct Score {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double error_px = 0;  ///< of fx, rms
};

Score score(const Trial& trial) {
  constexpr int kTrials = 20;
  const Lens lens;
  Score out;
  for (int i = 0; i < kTrials; ++i) {
    const CameraFit fit =
        fit_camera(views(trial, 1000 + static_cast<std::uint64_t>(i)), lens.width, lens.height);
    const auto& sigma = fit.uncertainty.sigma;
    out.fx += std::pow((fit.camera.fx_px - lens.fx) / sigma[0], 2) / kTrials;
    out.fy += std::pow((fit.camera.fy_px - lens.fy) / sigma[1], 2) / kTrials;
    out.cx += std::pow((fit.camera.cx_px - lens.cx) / sigma[2], 2) / kTrials;
    out.cy += std::pow((fit.camera.cy_px - lens.cy) / sigma[3], 2) / kTrials;
    out.error_px += std::pow(fit.camera.fx_px - lens.fx, 2) / kTrials;
  }
  out.error_px = std::sqrt(out.error_px);
  return out;
}

/// Of 20 trials the mean square of what is normal stays within 1 +- .32, one standard deviation.
void expect_honest(const Trial& trial) {
  const Score is = score(trial);
  for (const double part : {is.fx, is.fy, is.cx, is.cy}) {
    EXPECT_GT(part, 0.3);
    EXPECT_LT(part, 1.8);
  }
}

TEST(CameraSigma, CoversTheTruthOfManyViewsAndFew) {
  expect_honest({.views = 20});
  expect_honest({.views = 8});
}

TEST(CameraSigma, CoversTheTruthOfABoardThatIsNearlyFrontal) {
  expect_honest({.tilt = 0.15});
  expect_honest({.views = 8, .tilt = 0.2});
}

TEST(CameraSigma, CoversTheTruthOfABoardThatIsBowed) {
  expect_honest({.bend = 0.003});
  expect_honest({.views = 8, .bend = 0.003});
  EXPECT_LT(score({.bend = 0.003}).error_px, 0.0015 * Lens{}.fx) << "taken for flat it is 2 %";
}

TEST(CameraSigma, CoversTheTruthOfViewsThatWereMoved) {
  expect_honest({.shear_px = 1});
  expect_honest({.views = 8, .shear_px = 1});
}

TEST(CameraSigma, TellsThatViewsContradictEachOther) {
  const Lens lens;
  EXPECT_LT(fit_camera(views({}, 7), lens.width, lens.height).uncertainty.contradiction, 1.5);
  EXPECT_GT(
      fit_camera(views({.shear_px = 3}, 7), lens.width, lens.height).uncertainty.contradiction, 3);
}

TEST(CameraSigma, GrowsWhereNoCornersAre) {
  const Lens lens;
  std::vector<CameraView> left = views({.views = 24}, 7);
  for (CameraView& view : left)
    std::erase_if(view.corners, [](const BoardCorner& corner) { return corner.pixel.x() > 320; });
  std::erase_if(left, [](const CameraView& view) { return view.corners.size() < 20; });
  ASSERT_GE(left.size(), 8u);
  const auto px = fit_camera(left, lens.width, lens.height).uncertainty.regions_px;
  EXPECT_GT(px[5], 2 * px[3]) << "right beside left";
  EXPECT_LT(px[3], 1);
}

}  // namespace
}  // namespace tagwrench::test
