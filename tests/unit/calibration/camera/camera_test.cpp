// Camera calibration on rendered boards: the camera that took the pictures is known.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "host/calibration/camera/collect.h"
#include "host/calibration/camera/fit.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "tests/unit/calibration/camera/camera_render.h"

namespace tagwrench::test {
namespace {

constexpr const char* kCharuco = "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50";
constexpr const char* kCheckerboard = "checkerboard:9x6:1.2mm";
constexpr double kTilt = 0.5;  // rad
constexpr int kViews = 16;

/// Making the rays takes a second.
const BoardRenderer& renderer(const std::string& board) {
  static const BoardRenderer charuco(parse_board(kCharuco), Lens{});
  static const BoardRenderer checkerboard(parse_board(kCheckerboard), Lens{});
  return board == kCharuco ? charuco : checkerboard;
}

std::vector<cv::Mat> pictures(const std::string& board, int count = kViews, double tilt = kTilt,
                              const Conditions& conditions = {}) {
  std::vector<cv::Mat> out;
  for (const Placement& p : good_placements(Lens{}, count, tilt))
    out.push_back(renderer(board).render(p, 100 + out.size(), conditions));
  return out;
}

const std::vector<cv::Mat>& good_pictures() {
  static const std::vector<cv::Mat> all = pictures(kCharuco);
  return all;
}

const std::vector<cv::Mat>& plain_pictures() {
  static const std::vector<cv::Mat> all = pictures(kCheckerboard, 20);
  return all;
}

std::unique_ptr<ViewCollector> collected(const std::string& board,
                                         const std::vector<cv::Mat>& images) {
  auto collector = std::make_unique<ViewCollector>(parse_board(board), CameraModel{}, false);
  for (std::size_t i = 0; i < images.size(); ++i)
    collector->look(view_of(images[i]), "picture " + std::to_string(i));
  return collector;
}

/// Everything that the command does between pictures and file.
CameraFit calibrated(const ViewCollector& collector) {
  collector.check();
  CameraFit fit = fit_camera(collector.views(), Lens{}.width, Lens{}.height);
  Coverage coverage(Lens{}.width, Lens{}.height);
  for (std::size_t i = 0; i < fit.views.size(); ++i) {
    if (fit.views[i].used) coverage.add(collector.views()[i].corners, fit.views[i].pose);
  }
  check_fit(fit, coverage);
  return fit;
}

std::string refusal(const std::string& board, const std::vector<cv::Mat>& images) {
  try {
    calibrated(*collected(board, images));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "(accepted)";
}

void expect_mentions(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << "no '" << part << "' in: " << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

/// Largest distance between where the two cameras see the same direction, over the image. A small
/// turn of the camera is free: the board's poses take it up.
double worst_difference_px(const CameraModel& found, const Lens& lens) {
  Lens other{found.width_px,      found.height_px,     found.fx_px,         found.fy_px,
             found.cx_px,         found.cy_px,         found.distortion[0], found.distortion[1],
             found.distortion[2], found.distortion[3], found.distortion[4]};
  std::vector<cv::Point2d> is;
  std::vector<cv::Point3d> rays;
  for (double y = -0.27; y <= 0.271; y += 0.03) {
    for (double x = -0.37; x <= 0.371; x += 0.03) {
      rays.emplace_back(x, y, 1);
      is.push_back(lens.project(x, y));
    }
  }
  // Gauss-Newton on the three angles, by differences.
  cv::Vec3d turn(0, 0, 0);
  const auto errors = [&](const cv::Vec3d& by) {
    cv::Matx33d r;
    cv::Rodrigues(by, r);
    cv::Mat_<double> e(static_cast<int>(2 * rays.size()), 1);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const cv::Vec3d d = r * cv::Vec3d(rays[i].x, rays[i].y, rays[i].z);
      const cv::Point2d off = other.project(d[0] / d[2], d[1] / d[2]) - is[i];
      e(static_cast<int>(2 * i)) = off.x;
      e(static_cast<int>(2 * i + 1)) = off.y;
    }
    return e;
  };
  for (int n = 0; n < 5; ++n) {
    const cv::Mat_<double> e = errors(turn);
    cv::Mat_<double> j(e.rows, 3);
    for (int k = 0; k < 3; ++k) {
      cv::Vec3d step = turn;
      step[k] += 1e-6;
      cv::Mat column = (errors(step) - e) / 1e-6;
      column.copyTo(j.col(k));
    }
    cv::Mat_<double> d;
    cv::solve(j, -e, d, cv::DECOMP_SVD);
    turn += cv::Vec3d(d(0), d(1), d(2));
  }
  const cv::Mat_<double> left = errors(turn);
  double worst = 0;
  for (int i = 0; i < left.rows; i += 2) worst = std::max(worst, std::hypot(left(i), left(i + 1)));
  return worst;
}

void expect_recovered(const CameraFit& fit) {
  const Lens lens;
  EXPECT_NEAR(fit.camera.fx_px / lens.fx, 1, 0.002);
  EXPECT_NEAR(fit.camera.fy_px / lens.fy, 1, 0.002);
  EXPECT_NEAR(fit.camera.cx_px, lens.cx, 1.5);  // px
  EXPECT_NEAR(fit.camera.cy_px, lens.cy, 1.5);  // px
  EXPECT_LT(worst_difference_px(fit.camera, lens), 0.3);
  EXPECT_LT(std::abs(fit.camera.fx_px - lens.fx), 5 * fit.uncertainty.sigma[0]);
  EXPECT_LT(fit.uncertainty.sigma[0], 0.001 * lens.fx);
  EXPECT_LT(fit.rms_px, 0.06);
  EXPECT_EQ(fit.camera.distortion[4], 0) << "k3 does not help this lens";
}

TEST(CalibrateCamera, RecoversTheLensFromACharucoBoard) {
  const CameraFit fit = calibrated(*collected(kCharuco, good_pictures()));
  expect_recovered(fit);
  EXPECT_EQ(fit.used, kViews);
}

TEST(CalibrateCamera, RecoversTheLensFromACheckerboard) {
  expect_recovered(calibrated(*collected(kCheckerboard, plain_pictures())));
}

TEST(CalibrateCamera, RecoversTheLensThroughDefocusAndUnevenExposure) {
  Conditions conditions;
  conditions.blur_px = 2;
  conditions.noise = 3;
  conditions.black = 60;
  conditions.white = 150;
  const CameraFit fit =
      calibrated(*collected(kCharuco, pictures(kCharuco, kViews, kTilt, conditions)));
  EXPECT_NEAR(fit.camera.fx_px / Lens{}.fx, 1, 0.002);
  EXPECT_LT(worst_difference_px(fit.camera, Lens{}), 0.3);
}

TEST(CalibrateCamera, RecoversTheLensFromOverexposedPictures) {
  Conditions bright;
  bright.black = 90;
  bright.white = 420;
  const auto collector = collected(kCharuco, pictures(kCharuco, kViews, kTilt, bright));
  const CameraFit fit = calibrated(*collector);
  expect_recovered(fit);
  EXPECT_GE(fit.used, kViews - 1);
  for (const CameraView& view : collector->views()) EXPECT_GT(view.look.clipped_fraction, 0.9);
}

TEST(CalibrateCamera, RecoversTheLensFromABoardThatIsBowed) {
  Conditions bowed;
  bowed.bend = 0.003;  // squares: 0.06 at the board's edge, 1.3 % of half its length
  const CameraFit fit = calibrated(*collected(kCharuco, pictures(kCharuco, kViews, kTilt, bowed)));
  expect_recovered(fit);
  EXPECT_NEAR(fit.bow, 0.0105, 0.001);  // of the half, 3.5 squares, to the farthest corners
}

TEST(CalibrateCamera, FreesK3ForALensThatNeedsIt) {
  Lens lens;
  lens.k1 = -0.3;
  lens.k2 = 0.25;
  lens.k3 = -0.6;
  const BoardRenderer strong(parse_board(kCharuco), lens);
  std::vector<cv::Mat> images;
  for (const Placement& p : good_placements(lens, kViews, kTilt))
    images.push_back(strong.render(p, images.size()));
  const CameraFit fit = calibrated(*collected(kCharuco, images));
  EXPECT_NEAR(fit.camera.distortion[4], lens.k3, 0.1);
  EXPECT_LT(worst_difference_px(fit.camera, lens), 0.3);
}

TEST(CalibrateCamera, FindsOutThatTheImageIsMirrored) {
  std::vector<cv::Mat> flipped;
  for (const cv::Mat& image : good_pictures()) cv::flip(image, flipped.emplace_back(), 1);
  const auto collector = collected(kCharuco, flipped);
  EXPECT_TRUE(collector->mirrored());
  expect_recovered(calibrated(*collector));
  EXPECT_FALSE(collected(kCharuco, {good_pictures()[0]})->mirrored());
}

TEST(CalibrateCamera, DropsABentViewAndKnowsWhich) {
  std::vector<cv::Mat> images = good_pictures();
  Conditions bent;
  bent.bend = 0.02;  // squares: 0.4 at the board's edge
  images[5] = renderer(kCharuco).render(good_placements(Lens{}, kViews, kTilt)[5], 5, bent);
  const auto collector = collected(kCharuco, images);
  const CameraFit fit = calibrated(*collector);
  for (std::size_t i = 0; i < fit.views.size(); ++i) {
    EXPECT_EQ(fit.views[i].used, collector->views()[i].name != "picture 5")
        << collector->views()[i].name << ": " << fit.views[i].rms_px << " px";
  }
  expect_recovered(fit);
}

TEST(CalibrateCamera, LeavesOutASmearedView) {
  std::vector<cv::Mat> images = good_pictures();
  Conditions smeared;
  smeared.smear_px = {14, 5};
  images[4] = renderer(kCharuco).render(good_placements(Lens{}, kViews, kTilt)[4], 5, smeared);
  const auto collector = collected(kCharuco, images);
  const CameraFit fit = calibrated(*collector);
  for (std::size_t i = 0; i < fit.views.size(); ++i) {
    if (collector->views()[i].name == "picture 4") {
      EXPECT_FALSE(fit.views[i].used) << fit.views[i].rms_px << " px";
    }
  }
  expect_recovered(fit);
}

TEST(CalibrateCamera, RefusesTooFewViews) {
  const std::vector<cv::Mat>& all = good_pictures();
  expect_mentions(refusal(kCharuco, {all.begin(), all.begin() + 5}), {"only 5", "views"});
}

TEST(CalibrateCamera, RefusesOnePose) {
  const Placement pose = good_placements(Lens{}, 1, kTilt)[0];
  std::vector<cv::Mat> images;
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    images.push_back(renderer(kCharuco).render(pose, seed));
  expect_mentions(refusal(kCharuco, images), {"10 images", "same pose", "tilt"});
}

TEST(CalibrateCamera, RefusesABoardThatIsNeverTilted) {
  expect_mentions(refusal(kCharuco, pictures(kCharuco, 14, 0.02)), {"nearly frontal", "tilt"});
}

TEST(CalibrateCamera, RefusesABoardThatStaysInOnePlace) {
  std::vector<cv::Mat> images;
  for (Placement p : good_placements(Lens{}, 24, kTilt)) {
    p.middle = {0, 0, 34};
    images.push_back(renderer(kCharuco).render(p, images.size()));
  }
  expect_mentions(refusal(kCharuco, images), {"too much of the image empty", "top left"});
}

TEST(CalibrateCamera, TellsTheBoardThatItWasNotToldAbout) {
  const std::vector<cv::Mat> three(good_pictures().begin(), good_pictures().begin() + 3);
  expect_mentions(refusal("charuco:10x7:1mm:0.7mm:aruco_4x4_50", three),
                  {"charuco:10x7", "looks like charuco:9x6", "aruco_4x4_50"});
  expect_mentions(refusal("charuco:9x5:1.2mm:0.9mm:aruco_4x4_50", three),
                  {"looks like charuco:9x6", "aruco_4x4_50"});
  expect_mentions(refusal("charuco:9x6:1.2mm:0.9mm:aruco_5x5_100", three),
                  {"looks like charuco:9x6", "aruco_4x4_50"});
  expect_mentions(refusal("checkerboard:9x6:1.2mm", three), {"looks like charuco:9x6"});
  const std::vector<cv::Mat> plain(plain_pictures().begin(), plain_pictures().begin() + 3);
  const std::vector<cv::Mat> more(plain_pictures().begin(), plain_pictures().begin() + 9);
  expect_mentions(refusal("checkerboard:8x6:1.2mm", more), {"looks like checkerboard:9x6"});
  expect_mentions(refusal("checkerboard:11x8:1.2mm", plain), {"looks like checkerboard:9x6"});
  expect_mentions(refusal(kCharuco, plain), {"looks like checkerboard:9x6"});
}

TEST(CalibrateCamera, SaysWhyNoViewIsUsable) {
  const std::vector<cv::Mat> empty(3, cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)));
  expect_mentions(refusal(kCharuco, empty),
                  {"no usable view", "3 of 3 pictures are without the board"});
  Conditions dark;
  dark.black = 3;
  dark.white = 14;
  expect_mentions(refusal(kCharuco, pictures(kCharuco, 3, kTilt, dark)),
                  {"no usable view", "dark"});
  Conditions bright;
  bright.black = 250;
  bright.white = 700;
  expect_mentions(refusal(kCharuco, pictures(kCharuco, 3, kTilt, bright)),
                  {"no usable view", "overexposed"});
  Conditions soft;
  soft.blur_px = 7;
  expect_mentions(refusal(kCharuco, pictures(kCharuco, 3, kTilt, soft)),
                  {"no usable view", "blurred"});
  expect_mentions(refusal(kCharuco, {}), {"no usable view", "no image"});
}

TEST(CalibrateCamera, NamesWhatMostPicturesWereLostFor) {
  std::vector<cv::Mat> images(good_pictures().begin(), good_pictures().begin() + 4);
  Conditions soft;
  soft.blur_px = 7;
  for (const cv::Mat& image : pictures(kCharuco, 6, kTilt, soft)) images.push_back(image);
  images.emplace_back(480, 640, CV_8UC1, cv::Scalar(128));
  expect_mentions(refusal(kCharuco, images),
                  {"only 4 different usable views, 8 are needed",
                   "6 of 11 pictures are blurred: focus the lens and hold the board still"});
}

TEST(ViewCollector, KnowsWhatBecameOfEveryPicture) {
  std::vector<cv::Mat> images(good_pictures().begin(), good_pictures().begin() + 2);
  images.push_back(images[1]);
  for (int i = 0; i < 5; ++i) images.emplace_back(480, 640, CV_8UC1, cv::Scalar(128));
  const auto collector = collected(kCharuco, images);
  collector->set_aside({"odd", Fate::other_size, "320x240"});
  EXPECT_EQ(collector->pictures().all(), 9);
  EXPECT_EQ(collector->pictures().lines(),
            (std::vector<std::string>{"2 pictures usable: picture 0, picture 1",
                                      "1 picture too similar to another: picture 2 (as picture 1)",
                                      "5 pictures without the board: picture 3 to picture 7",
                                      "1 picture of another size: odd (320x240)"}));
}

TEST(ViewCollector, OfACameraCountsTheFrames) {
  ViewCollector collector(parse_board(kCharuco), CameraModel{}, true);
  const cv::Mat image = good_pictures()[0];
  for (int i = 0; i < 5; ++i) collector.look(view_of(image), "view 1");
  EXPECT_EQ(
      collector.pictures().lines(),
      (std::vector<std::string>{"1 picture usable: view 1", "2 pictures too similar to another",
                                "2 pictures in motion"}));
}

TEST(ViewCollector, WaitsUntilTheBoardIsStill) {
  ViewCollector collector(parse_board(kCharuco), CameraModel{}, true);
  Placement p = good_placements(Lens{}, 1, kTilt)[0];
  for (std::uint64_t i = 0; i < 4; ++i) {
    p.middle[0] += 0.1;  // squares: 5 px
    EXPECT_EQ(collector.look(view_of(renderer(kCharuco).render(p, i)), ""), ViewResult::moving);
  }
  EXPECT_EQ(collector.look(view_of(renderer(kCharuco).render(p, 11)), ""), ViewResult::moving);
  EXPECT_EQ(collector.look(view_of(renderer(kCharuco).render(p, 12)), ""), ViewResult::yes);
  EXPECT_EQ(collector.look(view_of(renderer(kCharuco).render(p, 13)), ""), ViewResult::alike);
  EXPECT_EQ(collector.views().size(), 1u);
}

TEST(ViewCollector, ThinsOutTheViewsThatAreMostAlike) {
  const auto collector = collected(kCharuco, good_pictures());
  collector->thin_out(9);
  EXPECT_EQ(collector->views().size(), 9u);
  EXPECT_EQ(collector->coverage().regions(), 9);
}

TEST(Coverage, NamesWhatIsMissing) {
  Coverage coverage(640, 480);
  EXPECT_EQ(coverage.regions(), 0);
  std::vector<BoardCorner> corners;
  for (int i = 0; i < 64; ++i)
    corners.push_back({{i % 8, i / 8}, {40.0 + 37 * (i % 8), 40.0 + 50 * (i / 8)}});  // left part
  BoardPose pose;
  pose.normal = Eigen::Vector3d(std::sin(0.4), 0, std::cos(0.4));
  pose.distance = 20;
  coverage.add(corners, pose);
  EXPECT_EQ(coverage.missing_regions(),
            (std::vector<std::string>{"top right", "right", "bottom right"}));
  EXPECT_NEAR(coverage.largest_tilt(), 0.4, 1e-9);  // rad
  const std::string missing = listed(coverage.missing());
  expect_mentions(missing, {"top right", "left, top and bottom edge", "nearer or farther"});
  pose.normal = Eigen::Vector3d(-std::sin(0.4), 0, std::cos(0.4));
  pose.distance = 15;
  coverage.add(corners, pose);
  expect_mentions(listed(coverage.missing()), {"top and bottom edge"});
  EXPECT_EQ(listed(coverage.missing()).find("nearer or farther"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test
