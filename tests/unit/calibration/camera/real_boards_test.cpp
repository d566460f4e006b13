// Camera calibration on photographs of boards, beside OpenCV's own on the same pictures. They lie
// in the folder real of the environment variable TAGWRENCH_DATA.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "host/calibration/camera/collect.h"
#include "host/calibration/camera/fit.h"
#include "tests/unit/calibration/camera/camera_render.h"

namespace tagwrench::test {
namespace {

namespace fs = std::filesystem;

/// As its documents show it: corners by the classic finder and cornerSubPix, a flat board.
struct ByOpenCv {
  int views = 0;
  double fx_px = 0, rms_px = 0;
};

ByOpenCv by_opencv(const std::vector<cv::Mat>& images, cv::Size inner) {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const cv::Mat& image : images) {
    std::vector<cv::Point2f> found;
    if (!cv::findChessboardCorners(image, inner, found)) continue;
    cv::cornerSubPix(image, found, {5, 5}, {-1, -1}, cv::TermCriteria(3, 50, 1e-3));
    pixels.push_back(found);
    board.emplace_back();
    for (int i = 0; i < inner.area(); ++i) {
      board.back().emplace_back(static_cast<float>(i % inner.width),
                                static_cast<float>(i / inner.width), 0.0F);
    }
  }
  cv::Mat matrix, distortion;
  std::vector<cv::Mat> rotations, translations;
  ByOpenCv out;
  out.rms_px = cv::calibrateCamera(board, pixels, images.front().size(), matrix, distortion,
                                   rotations, translations, cv::CALIB_FIX_K3);
  out.views = static_cast<int>(board.size());
  out.fx_px = matrix.at<double>(0, 0);
  return out;
}

class RealBoards : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TAGWRENCH_DATA");
    if (data == nullptr) GTEST_SKIP() << "TAGWRENCH_DATA is not set: no photographs of boards";
    folder_ = fs::path(data) / "real";
    if (!fs::is_directory(folder_)) GTEST_SKIP() << "TAGWRENCH_DATA holds no folder real";
  }

  /// Accepted; prints both results.
  void calibrate(const std::string& set, const std::string& board, cv::Size inner) {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / set))
      files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<cv::Mat> images;
    for (const fs::path& file : files)
      images.push_back(cv::imread(file.string(), cv::IMREAD_GRAYSCALE));
    ASSERT_FALSE(images.empty());
    CameraModel camera;
    camera.width_px = images.front().cols;
    camera.height_px = images.front().rows;
    ViewCollector collector(parse_board(board), camera, false);
    for (std::size_t i = 0; i < files.size(); ++i)
      collector.look(view_of(images[i]), files[i].filename().string());
    pictures_ = collector.pictures();
    collector.check();
    fit_ = fit_camera(collector.views(), camera.width_px, camera.height_px);
    Coverage coverage(camera.width_px, camera.height_px);
    for (std::size_t i = 0; i < fit_.views.size(); ++i)
      if (fit_.views[i].used) coverage.add(collector.views()[i].corners, fit_.views[i].pose);
    EXPECT_NO_THROW(check_fit(fit_, coverage));
    opencv_ = by_opencv(images, inner);
    std::cout << fmt::format(
        "{}: ours fx {:.2f} +- {:.2f} px, rms {:.3f} px, {} views; OpenCV's fx {:.2f} px, rms "
        "{:.3f} px, {} views\n",
        set, fit_.camera.fx_px, fit_.uncertainty.sigma[0], fit_.rms_px, fit_.used, opencv_.fx_px,
        opencv_.rms_px, opencv_.views);
    EXPECT_LT(fit_.rms_px, opencv_.rms_px);
    EXPECT_LT(fit_.uncertainty.sigma[0], 0.01 * fit_.camera.fx_px);
    EXPECT_NEAR(fit_.camera.fx_px, opencv_.fx_px, 2 * fit_.uncertainty.sigma[0]);
  }

  fs::path folder_;
  Pictures pictures_;
  CameraFit fit_;
  ByOpenCv opencv_;
};

TEST_F(RealBoards, OverexposedOnesOfTwoCamerasMakeTwoLenses) {
  std::vector<double> fx_px;
  for (const char* set : {"boards_a/left", "boards_a/right"}) {
    calibrate(set, "checkerboard:9x7:25mm", {8, 6});
    EXPECT_EQ(fit_.used, 14);
    EXPECT_EQ(pictures_.count(Fate::no_board), 8);
    EXPECT_EQ(pictures_.count(Fate::alike), 2);
    EXPECT_EQ(pictures_.all(), 24);
    fx_px.push_back(fit_.camera.fx_px);
  }
  // Two of one make.
  EXPECT_NEAR(fx_px[1] / fx_px[0], 1, 0.01);
}

TEST_F(RealBoards, EveryPictureThatShowsItIsUsed) {
  calibrate("boards_b", "checkerboard:8x8:25mm", {7, 7});
  EXPECT_EQ(fit_.used, 19);
  EXPECT_EQ(fit_.used, opencv_.views);
  const std::vector<std::string> lines = pictures_.lines();
  EXPECT_EQ(lines.back(), "1 picture without the board: perspectiveimg.jpg");
}

}  // namespace
}  // namespace tagwrench::test
