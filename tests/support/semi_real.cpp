#include "tests/support/semi_real.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <tuple>

#include "tests/support/compound_motion.h"
#include "tests/support/frame_folder.h"
#include "tests/support/plane_fit.h"

namespace tagwrench::test {
namespace {

constexpr int kFiner = 4;
constexpr int kMargin = 80;  // px, reflected around the picture: the platform moves less
constexpr int kRestFrames = 25;
constexpr int kCells = 7;  // of an ArUco original tag, black frame included

/// Band-limited interpolation: the Fourier transform with zeros for the frequencies that it lacks.
cv::Mat finer(const cv::Mat& picture) {
  cv::Mat padded;
  cv::copyMakeBorder(picture, padded, kMargin, kMargin, kMargin, kMargin, cv::BORDER_REFLECT_101);
  padded.convertTo(padded, CV_32F);
  cv::Mat spectrum;
  cv::dft(padded, spectrum, cv::DFT_COMPLEX_OUTPUT);
  cv::Mat wide = cv::Mat::zeros(padded.rows * kFiner, padded.cols * kFiner, CV_32FC2);
  const int left = padded.cols / 2, right = padded.cols - left;
  const int top = padded.rows / 2, bottom = padded.rows - top;
  for (const auto& [from, to, rows] : {std::tuple{0, 0, top}, {top, wide.rows - bottom, bottom}}) {
    spectrum(cv::Rect(0, from, left, rows)).copyTo(wide(cv::Rect(0, to, left, rows)));
    spectrum(cv::Rect(left, from, right, rows))
        .copyTo(wide(cv::Rect(wide.cols - right, to, right, rows)));
  }
  // The highest frequency is its own mirror image; half of it belongs to either side.
  wide.col(wide.cols - right) *= 0.5;
  wide.col(wide.cols - right).copyTo(wide.col(left));
  wide.row(wide.rows - bottom) *= 0.5;
  wide.row(wide.rows - bottom).copyTo(wide.row(top));
  cv::Mat result;
  cv::dft(wide, result, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT);
  result /= static_cast<double>(padded.total());
  return result;
}

/// Catmull and Rom's cubic.
std::array<float, 4> cubic(float t) {
  const float t2 = t * t;
  const float t3 = t2 * t;
  return {0.5F * (-t3 + 2 * t2 - t), 0.5F * (3 * t3 - 5 * t2 + 2), 0.5F * (-3 * t3 + 4 * t2 + t),
          0.5F * (t3 - t2)};
}

Eigen::Matrix3d plane_in_camera(const Eigen::Isometry3d& pose) {
  Eigen::Matrix3d m;
  m << pose.linear().leftCols<2>(), pose.translation();
  return m;
}

Eigen::Isometry3d ippe(const std::vector<cv::Point2f>& corners, double size,
                       const Eigen::Matrix3d& camera) {
  const double h = 0.5 * size;
  const std::vector<cv::Point3d> square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  const cv::Matx33d k(camera(0, 0), 0, camera(0, 2), 0, camera(1, 1), camera(1, 2), 0, 0, 1);
  cv::Vec3d r, t;
  cv::solvePnP(square, corners, k, cv::noArray(), r, t, false, cv::SOLVEPNP_IPPE_SQUARE);
  const Eigen::Vector3d axis(r[0], r[1], r[2]);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  // OpenCV's square has y up; the tag's y points down.
  pose.linear() = Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix() *
                  Eigen::Vector3d(1, -1, -1).asDiagonal();
  pose.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
  return pose;
}

std::string list(const Eigen::Vector3d& v) {
  return fmt::format("[{:.9g}, {:.9g}, {:.9g}]", v.x(), v.y(), v.z());
}

}  // namespace

std::optional<std::filesystem::path> real_picture() {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (data == nullptr) return std::nullopt;
  const std::filesystem::path path =
      std::filesystem::path(data) / "icra2020" / "2019-09-13_120207_first_frame_640x480.jpg";
  std::error_code unreadable;
  if (!std::filesystem::exists(path, unreadable)) return std::nullopt;
  return path;
}

SemiReal::SemiReal(const std::filesystem::path& picture, const SemiRealOptions& options)
    : options_(options) {
  cv::Mat real = cv::imread(picture.string(), cv::IMREAD_GRAYSCALE);
  if (real.empty()) throw std::runtime_error(picture.string() + ": is not a picture");
  cv::flip(real, real, 1);
  width_ = real.cols;
  height_ = real.rows;
  camera_ << options.f_px, 0, 0.5 * (width_ - 1), 0, options.f_px, 0.5 * (height_ - 1), 0, 0, 1;
  pose_tags(real);
  find_ridge();
  fine_ = finer(real);
}

void SemiReal::pose_tags(const cv::Mat& picture) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = options_.planes == TagPlanes::by_ink
                                           ? cv::aruco::CORNER_REFINE_CONTOUR  // lines along edges
                                           : cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL);
  cv::aruco::detectMarkers(picture, dictionary, corners, ids, parameters);
  origin_.setZero();
  for (const int id : options_.ids) {
    const auto at = std::find(ids.begin(), ids.end(), id);
    if (at == ids.end()) throw std::runtime_error(fmt::format("the picture shows no tag {}", id));
    const Eigen::Isometry3d start =
        ippe(corners[static_cast<std::size_t>(at - ids.begin())], options_.tag_size, camera_);
    cv::Mat cells;
    cv::aruco::drawMarker(dictionary, id, kCells, cells, 1);
    camera_T_tag_.push_back(options_.planes == TagPlanes::by_ink
                                ? fit_tag_plane(picture, camera_, cells, options_.tag_size, start)
                                : start);
    origin_ += camera_T_tag_.back().translation() / static_cast<double>(options_.ids.size());
  }
}

// Where the planes meet, n1 X = d1 and n2 X = d2: a ray r lies on the ridge's side where
// (n1 / d1 - n2 / d2) r has one sign.
void SemiReal::find_ridge() {
  const auto plane = [&](std::size_t t) -> Eigen::Vector3d {
    const Eigen::Vector3d n = camera_T_tag_[t].linear().col(2);
    return n / n.dot(camera_T_tag_[t].translation());
  };
  const Eigen::Vector3d in_rays = plane(0) - plane(1);
  ridge_ = camera_.inverse().transpose() * in_rays;
  const auto side = [&](std::size_t t) {
    return ridge_.dot(camera_ * camera_T_tag_[t].translation());
  };
  if (side(0) < 0) ridge_ = -ridge_;
  if (side(1) > 0) throw std::runtime_error("the tags' planes do not meet between the tags");
}

Vector6 SemiReal::displacement(int frame) const {
  return compound_motion(options_.amplitude, (frame - kRestFrames) / options_.frame_rate);
}

float SemiReal::sample(double x, double y) const {
  const auto fx = static_cast<float>(
      std::clamp((x + kMargin) * kFiner, 1.0, static_cast<double>(fine_.cols - 3)));
  const auto fy = static_cast<float>(
      std::clamp((y + kMargin) * kFiner, 1.0, static_cast<double>(fine_.rows - 3)));
  const int column = static_cast<int>(fx);
  const int row = static_cast<int>(fy);
  const std::array<float, 4> across = cubic(fx - static_cast<float>(column));
  const std::array<float, 4> down = cubic(fy - static_cast<float>(row));
  float sum = 0;
  for (int v = 0; v < 4; ++v) {
    const float* from = fine_.ptr<float>(row - 1 + v) + column - 1;
    sum += down[static_cast<std::size_t>(v)] *
           (across[0] * from[0] + across[1] * from[1] + across[2] * from[2] + across[3] * from[3]);
  }
  return sum;
}

cv::Mat SemiReal::light(const Vector6& displacement) const {
  const Eigen::Vector3d r = displacement.tail<3>();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) motion.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).matrix();
  motion.translation() = origin_ + displacement.head<3>() - motion.linear() * origin_;
  std::array<Eigen::Matrix3d, 2> rest_from_now;
  for (std::size_t t = 0; t < 2; ++t) {
    rest_from_now[t] = camera_ * plane_in_camera(camera_T_tag_[t]) *
                       plane_in_camera(motion * camera_T_tag_[t]).inverse() * camera_.inverse();
  }
  cv::Mat light(height_, width_, CV_32F);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Eigen::Vector3d pixel(x, y, 1);
      Eigen::Vector3d rest = rest_from_now[0] * pixel;
      if (ridge_.dot(rest) * rest.z() < 0) rest = rest_from_now[1] * pixel;
      light.at<float>(y, x) = sample(rest.x() / rest.z(), rest.y() / rest.z());
    }
  }
  return light;
}

cv::Mat SemiReal::picture(const Vector6& displacement, std::uint64_t sequence) const {
  cv::Mat light = this->light(displacement);
  cv::Mat noise(light.size(), CV_32F);
  cv::RNG random(sequence + 1);
  random.fill(noise, cv::RNG::NORMAL, 0, options_.noise_counts);
  light += noise;
  cv::Mat picture;
  light.convertTo(picture, CV_8U);
  if (options_.jpeg_quality > 0) {
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, options_.jpeg_quality});
    picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  }
  return picture;
}

std::string SemiReal::sensor_yaml(bool true_geometry) const {
  std::string text = fmt::format(
      "camera: {{width: {}, height: {}, fx: {}, fy: {}, cx: {}, cy: {}}}\n"
      "target:\n  family: aruco_original\n  tag_size_mm: {}\n  border_mm: {}\n  tags:\n",
      width_, height_, options_.f_px, options_.f_px, camera_(0, 2), camera_(1, 2),
      1e3 * options_.tag_size, 1e3 * options_.border);
  for (std::size_t t = 0; t < options_.ids.size(); ++t) {
    text += fmt::format("    - {{id: {}", options_.ids[t]);
    if (true_geometry) {
      const Eigen::AngleAxisd turn(camera_T_tag_[t].linear());
      text += fmt::format(", position_mm: {}, rotation_rad: {}",
                          list(1e3 * (camera_T_tag_[t].translation() - origin_)),
                          list(turn.angle() * turn.axis()));
    }
    text += "}\n";
  }
  text += fmt::format("rest: {{frames: {}", kRestFrames);
  if (true_geometry)
    text += fmt::format(", position_mm: {}, rotation_rad: [0, 0, 0]", list(1e3 * origin_));
  return text +
         "}\n"
         "wrench: {springs: {centres_mm: [[11, 7, -11], [-11, 7, -11], [11, -7, -11], [-11, -7, "
         "-11]],\n"
         "                   axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07},\n"
         "         range_n: [10, 10, 10], range_nm: [1, 1, 1]}\n";
}

void SemiReal::write_folder(const std::filesystem::path& folder, int frames) const {
  write_frame_folder({frames, options_.frame_rate, sensor_yaml(false),
                      [this](int frame) { return displacement(frame); },
                      [this](int frame) {
                        return picture(displacement(frame), static_cast<std::uint64_t>(frame));
                      }},
                     folder);
}

}  // namespace tagwrench::test
