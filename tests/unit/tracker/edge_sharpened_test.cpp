// The width of a tag's edges in pictures that the camera has sharpened: of the lens, not of what is
// left of it.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/tracker/acquire.h"
#include "host/tracker/picture_quality.h"
#include "tests/unit/tracker/render.h"

namespace tagwrench {
namespace {

constexpr double kInk = 38, kPaper = 205;  // grey levels of the renderer

/// What a webcam does to its picture.
struct Camera {
  double amount = 0, radius_px = 1;     ///< of its unsharp mask
  bool across = false;                  ///< along its rows only
  double limit = 255;                   ///< of the mask's change, grey levels
  double black = kInk, white = kPaper;  ///< grey levels of what is rendered; cut off at 0 and 255
  int jpeg = 100;                       ///< quality
};

/// Without blur and noise, four times as fine: a kernel on the pixels themselves would blur by
/// another width than it says.
const cv::Mat& fine_light() {
  constexpr int kFine = 4;
  static render::Scene scene = [] {
    render::Scene fine = render::roof();
    fine.width *= kFine;
    fine.height *= kFine;
    fine.f_px *= kFine;
    fine.cx_px = kFine * (fine.cx_px + 0.5) - 0.5;
    fine.cy_px = kFine * (fine.cy_px + 0.5) - 0.5;
    fine.blur_px = 1e-3;
    fine.supersample = 2;
    return fine;
  }();
  static std::vector<float> light = render::expose(scene, Vector6::Zero());
  static const cv::Mat image(scene.height, scene.width, CV_32F, light.data());
  return image;
}

std::vector<EdgeWidth> widths(double blur_px, const Camera& camera) {
  cv::Mat fine, image, soft, grey;
  cv::GaussianBlur(fine_light(), fine, {}, 4 * blur_px);
  cv::resize(fine, image, {640, 480}, 0, 0, cv::INTER_AREA);
  image = camera.black + (image - kInk) * ((camera.white - camera.black) / (kPaper - kInk));
  cv::Mat noise(image.size(), CV_32F);
  cv::RNG random(3);
  random.fill(noise, cv::RNG::NORMAL, 0, 2);  // grey levels
  image += noise;
  cv::GaussianBlur(image, soft, camera.across ? cv::Size(0, 1) : cv::Size(), camera.radius_px);
  cv::Mat change = camera.amount * (image - soft);
  change = cv::min(cv::max(change, -camera.limit), camera.limit);
  image += change;
  image.convertTo(grey, CV_8U);
  if (camera.jpeg < 100) {
    std::vector<std::uint8_t> file;
    cv::imencode(".jpg", grey, file, {cv::IMWRITE_JPEG_QUALITY, camera.jpeg});
    grey = cv::imdecode(file, cv::IMREAD_GRAYSCALE);
  }
  const ImageView view{grey.data, grey.cols, grey.rows, static_cast<int>(grey.step)};
  Acquirer acquirer(CameraModel{}, TargetDescription{});
  std::vector<EdgeWidth> out;
  for (const FoundTag& tag : acquirer.find(view).tags) {
    const auto width = edge_width(view, acquirer.patterns()[tag.index], tag.corners_px);
    if (width) out.push_back(*width);
  }
  return out;
}

/// Mean of both tags for lenses that get softer and softer; it must follow.
void expect_lens(const Camera& camera, double part, double least_px) {
  double before = 0;
  for (const double blur : {0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 3.0}) {
    const std::vector<EdgeWidth> found = widths(blur, camera);
    ASSERT_EQ(found.size(), 2u) << blur << " px";
    const double mean = 0.5 * (found[0].blur_px + found[1].blur_px);
    EXPECT_NEAR(mean, blur, std::max(part * blur, least_px));
    EXPECT_GT(mean, before) << blur << " px";
    before = mean;
  }
}

TEST(SharpenedEdge, WithoutSharpeningTheWidthIsThatOfTheLens) {
  expect_lens({}, 0.02, 0.01);
  for (const EdgeWidth& width : widths(1, {})) EXPECT_LT(width.sharpening, 0.1);
}

TEST(SharpenedEdge, AnUnsharpMaskDoesNotMakeABetterLens) {
  for (const double radius_px : {0.7, 1.0, 1.5})
    for (const double amount : {0.5, 1.0, 1.5})
      expect_lens({.amount = amount, .radius_px = radius_px}, 0.08, 0.1);
  for (const EdgeWidth& width : widths(1, {.amount = 1})) EXPECT_NEAR(width.sharpening, 1, 0.3);
}

TEST(SharpenedEdge, NorDoWhatElseWebcamsDo) {
  expect_lens({.amount = 1, .jpeg = 85}, 0.05, 0.04);
  expect_lens({.amount = 1, .limit = 20}, 0.05, 0.05);
  expect_lens({.amount = 1.5, .black = 15, .white = 235}, 0.08, 0.12);
  expect_lens({.amount = 1, .across = true}, 0.08, 0.14);
}

TEST(SharpenedEdge, SharperThanCanBeMeasuredIsTheLeast) {
  for (const EdgeWidth& width : widths(0.05, {})) EXPECT_EQ(width.blur_px, kLeastBlur_px);
}

}  // namespace
}  // namespace tagwrench
