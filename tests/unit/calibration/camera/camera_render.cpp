#include "tests/unit/calibration/camera/camera_render.h"

#include <cmath>
#include <numbers>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "host/tracker/tag_dictionary.h"

namespace tagwrench::test {
namespace {

constexpr int kSupersample = 3;
constexpr int kArtPixels = 96;  // per square
constexpr int kMargin = 1;      // squares of white around

cv::Mat board_art(const BoardSpec& board) {
  cv::Mat art(kArtPixels * (board.rows + 2 * kMargin), kArtPixels * (board.columns + 2 * kMargin),
              CV_32F, cv::Scalar(1));
  const int side =
      2 * static_cast<int>(std::lround(0.5 * kArtPixels * board.marker / board.square));
  int id = 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const int x = kArtPixels * (column + kMargin);
      const int y = kArtPixels * (row + kMargin);
      if ((row + column) % 2 == 0) {
        art(cv::Rect(x, y, kArtPixels, kArtPixels)) = 0;
      } else if (board.kind == BoardKind::charuco) {
        cv::Mat marker;
        cv::aruco::drawMarker(tag_dictionary(board.dictionary), id++, side, marker, 1);
        const int gap = (kArtPixels - side) / 2;
        marker.convertTo(art(cv::Rect(x + gap, y + gap, side, side)), CV_32F, 1.0 / 255);
      }
    }
  }
  return art;
}

cv::Point2d ray(const Lens& lens, cv::Point2d pixel) {
  const double xd = (pixel.x - lens.cx) / lens.fx;
  const double yd = (pixel.y - lens.cy) / lens.fy;
  double x = xd;
  double y = yd;
  for (int i = 0; i < 30; ++i) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
    const double nx = (xd - 2 * lens.p1 * x * y - lens.p2 * (r2 + 2 * x * x)) / radial;
    const double ny = (yd - lens.p1 * (r2 + 2 * y * y) - 2 * lens.p2 * x * y) / radial;
    const bool found = std::abs(nx - x) + std::abs(ny - y) < 1e-13;
    x = nx;
    y = ny;
    if (found) break;
  }
  return {x, y};
}

}  // namespace

cv::Point2d Lens::project(double x, double y) const {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
          fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy};
}

BoardRenderer::BoardRenderer(const BoardSpec& board, const Lens& lens)
    : board_(board), lens_(lens), art_(board_art(board)) {
  for (int y = 0; y < lens.height * kSupersample; ++y) {
    for (int x = 0; x < lens.width * kSupersample; ++x)
      rays_.push_back(ray(lens, {(x + 0.5) / kSupersample - 0.5, (y + 0.5) / kSupersample - 0.5}));
  }
}

cv::Mat BoardRenderer::render(const Placement& placement, std::uint64_t seed,
                              const Conditions& conditions) const {
  cv::Matx33d r;
  cv::Rodrigues(placement.rotation, r);
  const cv::Matx33d back = r.t();
  const cv::Vec3d eye = back * -placement.middle;  // the lens, in the board's axes
  cv::Mat map_x(lens_.height * kSupersample, lens_.width * kSupersample, CV_32F);
  cv::Mat map_y(map_x.size(), CV_32F);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const cv::Vec3d d = back * cv::Vec3d(rays_[i].x, rays_[i].y, 1);
    double s = -eye[2] / d[2];
    for (int n = 0; conditions.bend != 0 && n < 8; ++n) {
      const double x = eye[0] + s * d[0];
      s = (conditions.bend * x * x - eye[2]) / d[2];
    }
    const double u = eye[0] + s * d[0] + 0.5 * board_.columns + kMargin;
    const double v = eye[1] + s * d[1] + 0.5 * board_.rows + kMargin;
    map_x.at<float>(static_cast<int>(i) / map_x.cols, static_cast<int>(i) % map_x.cols) =
        static_cast<float>(u * kArtPixels - 0.5);
    map_y.at<float>(static_cast<int>(i) / map_x.cols, static_cast<int>(i) % map_x.cols) =
        static_cast<float>(v * kArtPixels - 0.5);
  }
  cv::Mat fine;
  cv::remap(art_, fine, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0.6));
  cv::Mat image;
  cv::resize(fine, image, {lens_.width, lens_.height}, 0, 0, cv::INTER_AREA);
  if (conditions.blur_px > 0) cv::GaussianBlur(image, image, {}, conditions.blur_px);
  if (conditions.smear_px != cv::Point2d(0, 0)) {
    const cv::Mat still = image.clone();
    constexpr int kSteps = 16;
    for (int i = 1; i <= kSteps; ++i) {
      const cv::Point2d by = conditions.smear_px * (static_cast<double>(i) / kSteps);
      cv::Mat moved;
      cv::warpAffine(still, moved, cv::Matx23d(1, 0, by.x, 0, 1, by.y), still.size(),
                     cv::INTER_LINEAR, cv::BORDER_REPLICATE);
      image += moved;
    }
    image /= kSteps + 1;
  }
  image = conditions.black + (conditions.white - conditions.black) * image;
  cv::RNG random(seed);
  cv::Mat noise(image.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0, conditions.noise);
  image += noise;
  image.convertTo(image, CV_8U);
  return image;
}

std::vector<Placement> good_placements(const Lens& lens, int count, double tilt,
                                       std::uint64_t seed) {
  cv::RNG random(seed);
  std::vector<Placement> out;
  for (int i = 0; i < count; ++i) {
    const double direction = 2 * std::numbers::pi * i * 0.381966 + random.uniform(-0.2, 0.2);
    const double lean = tilt * random.uniform(0.8, 1.2);
    cv::Matx33d tilted;
    cv::Matx33d turned;
    cv::Rodrigues(cv::Vec3d(lean * std::cos(direction), lean * std::sin(direction), 0), tilted);
    cv::Rodrigues(cv::Vec3d(0, 0, random.uniform(-0.5, 0.5)), turned);
    Placement p;
    cv::Rodrigues(tilted * turned, p.rotation);
    const double z = random.uniform(14.0, 20.0);
    const double x = (i % 3 - 1) * 0.16 * lens.width / lens.fx;
    const double y = (i / 3 % 3 - 1) * 0.16 * lens.height / lens.fy;
    p.middle = {x * z, y * z, z};
    out.push_back(p);
  }
  return out;
}

ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step)};
}

}  // namespace tagwrench::test
