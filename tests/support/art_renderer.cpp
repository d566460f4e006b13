#include "tests/support/art_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/compound_motion.h"
#include "tests/support/frame_folder.h"

namespace tagwrench::test {
namespace {

constexpr int kSamples = 4;          // along each side of a pixel
constexpr int kTexelsPerCell = 336;  // of a tag; about 15 texels to a pixel
constexpr int kCells = 7;            // of an ArUco original tag, black frame included
constexpr int kRestFrames = 25;
// Art has no detail that the samples could miss: smoothed by one sample's width.
constexpr double kArtSmoothing_samples = 1.0;
constexpr double kBlurReach = 4;         // sigmas
constexpr double kPlateBehind = 3.0e-3;  // m
constexpr double kPlateHalf = 14e-3;     // m
constexpr double kPlateTexels_per_m = 30e3;

cv::Matx33d rotation_of(const cv::Vec3d& r) {
  cv::Matx33d rotation;
  cv::Rodrigues(r, rotation);
  return rotation;
}

/// [r1 r2 t] of a plane whose pose in the platform frame is (rotation, position).
cv::Matx33d plane_in_camera(const cv::Vec3d& position, const cv::Vec3d& rotation,
                            const cv::Vec3d& rest_position, const Vector6& d) {
  const cv::Matx33d turn = rotation_of({d[3], d[4], d[5]});
  const cv::Matx33d r = turn * rotation_of(rotation);
  const cv::Vec3d t = turn * position + rest_position + cv::Vec3d(d[0], d[1], d[2]);
  return {r(0, 0), r(0, 1), t[0], r(1, 0), r(1, 1), t[1], r(2, 0), r(2, 1), t[2]};
}

cv::Matx33d camera_matrix(const ArtScene& s) {
  return {s.f_px, 0, s.cx_px, 0, s.f_px, s.cy_px, 0, 0, 1};
}

std::vector<double> distortion_of(const ArtScene& s) {
  return {s.distortion.begin(), s.distortion.end()};
}

/// Rays (x/z, y/z) of all pixels, CV_64FC2.
cv::Mat pixel_rays(const ArtScene& s) {
  cv::Mat pixels(s.height, s.width, CV_64FC2);
  for (int y = 0; y < s.height; ++y)
    for (int x = 0; x < s.width; ++x) pixels.at<cv::Vec2d>(y, x) = {double(x), double(y)};
  cv::Mat rays;
  const cv::Mat flat = pixels.reshape(2, s.width * s.height);
  const cv::TermCriteria until_exact(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12);
  cv::undistortPoints(flat, rays, camera_matrix(s), distortion_of(s), cv::noArray(), cv::noArray(),
                      until_exact);
  return rays.reshape(2, s.height);
}

/// Rays of all samples, CV_32FC2: between pixels, which is exact without distortion and good to
/// 1e-4 px with it.
cv::Mat sample_rays(const cv::Mat& rays) {
  cv::Mat fine(rays.rows * kSamples, rays.cols * kSamples, CV_32FC2);
  for (int y = 0; y < fine.rows; ++y) {
    const double v = (y + 0.5) / kSamples - 0.5;
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, rays.rows - 2);
    const double b = v - row;
    for (int x = 0; x < fine.cols; ++x) {
      const double u = (x + 0.5) / kSamples - 0.5;
      const int column = std::clamp(static_cast<int>(std::floor(u)), 0, rays.cols - 2);
      const double a = u - column;
      const auto at = [&](int dy, int dx) { return rays.at<cv::Vec2d>(row + dy, column + dx); };
      const cv::Vec2d ray =
          (1 - b) * ((1 - a) * at(0, 0) + a * at(0, 1)) + b * ((1 - a) * at(1, 0) + a * at(1, 1));
      fine.at<cv::Vec2f>(y, x) = {float(ray[0]), float(ray[1])};
    }
  }
  return fine;
}

/// Where a plane's points are seen along `rays`: CV_32FC2.
cv::Mat through(const cv::Matx33d& plane_from_ray, const cv::Mat& rays) {
  const cv::Matx33d& h = plane_from_ray;
  cv::Mat points(rays.size(), CV_32FC2);
  for (int y = 0; y < rays.rows; ++y) {
    const auto* ray = rays.ptr<cv::Vec2f>(y);
    auto* point = points.ptr<cv::Vec2f>(y);
    for (int x = 0; x < rays.cols; ++x) {
      const double w = 1 / (h(2, 0) * ray[x][0] + h(2, 1) * ray[x][1] + h(2, 2));
      point[x] = {float((h(0, 0) * ray[x][0] + h(0, 1) * ray[x][1] + h(0, 2)) * w),
                  float((h(1, 0) * ray[x][0] + h(1, 1) * ray[x][1] + h(1, 2)) * w)};
    }
  }
  return points;
}

cv::Mat tag_drawing(int id) {
  cv::Mat drawing;
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL), id,
                        kCells * kTexelsPerCell, drawing, 1);
  return drawing;
}

}  // namespace

ArtRenderer::ArtRenderer(const ArtScene& scene) : scene_(scene) {
  const cv::Mat rays = pixel_rays(scene);
  rays.convertTo(rays_, CV_32F);
  fine_rays_ = sample_rays(rays);
  for (const ArtTag& tag : scene.tags) {
    Art art;
    art.texels_per_m = kCells * kTexelsPerCell / scene.tag_size;
    const int border = static_cast<int>(std::lround(scene.border * art.texels_per_m));
    const int outside = kTexelsPerCell;
    cv::Mat paper;
    cv::copyMakeBorder(tag_drawing(tag.id), paper, border, border, border, border,
                       cv::BORDER_CONSTANT, 255);
    cv::Mat light, coverage;
    paper.convertTo(light, CV_32F, (scene.paper_counts - scene.ink_counts) / 255, scene.ink_counts);
    coverage = cv::Mat(paper.size(), CV_32F, cv::Scalar(1));
    for (cv::Mat* layer : {&light, &coverage}) {
      cv::copyMakeBorder(*layer, *layer, outside, outside, outside, outside, cv::BORDER_CONSTANT,
                         0);
      const double texels_per_sample =
          art.texels_per_m * scene.rest_position[2] / scene.f_px / kSamples;
      cv::GaussianBlur(*layer, *layer, {}, kArtSmoothing_samples * texels_per_sample);
    }
    cv::merge(std::vector<cv::Mat>{light, coverage}, art.ink_and_paper);
    art_.push_back(art);
  }
  const int side = static_cast<int>(2 * kPlateHalf * kPlateTexels_per_m);
  plate_.create(side, side, CV_32F);
  cv::RNG random(11);
  random.fill(plate_, cv::RNG::NORMAL, scene.plate_counts, 150);
  cv::GaussianBlur(plate_, plate_, {}, 4);
}

cv::Matx33d ArtRenderer::ray_from_plane(const ArtTag& tag, const Vector6& displacement) const {
  return plane_in_camera(tag.position, tag.rotation, scene_.rest_position, displacement);
}

cv::Point2d ArtRenderer::project(const ArtTag& tag, const cv::Point2d& point,
                                 const Vector6& displacement) const {
  const cv::Vec3d ray = ray_from_plane(tag, displacement) * cv::Vec3d(point.x, point.y, 1);
  std::vector<cv::Point2d> pixel;
  cv::projectPoints(std::vector<cv::Point3d>{{ray[0], ray[1], ray[2]}}, cv::Vec3d(), cv::Vec3d(),
                    camera_matrix(scene_), distortion_of(scene_), pixel);
  return pixel.front();
}

cv::Mat ArtRenderer::plate(const cv::Mat& rays, const Vector6& displacement) const {
  const cv::Matx33d texel_from_plane(kPlateTexels_per_m, 0, 0.5 * (plate_.cols - 1), 0,
                                     kPlateTexels_per_m, 0.5 * (plate_.rows - 1), 0, 0, 1);
  const cv::Matx33d h =
      texel_from_plane *
      plane_in_camera({0, 0, kPlateBehind}, {0, 0, 0}, scene_.rest_position, displacement).inv();
  cv::Mat scene;
  cv::remap(plate_, scene, through(h, rays), cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return scene;
}

void ArtRenderer::draw_tag(std::size_t tag, const Vector6& displacement, const cv::Mat& rays,
                           cv::Mat& scene) const {
  const Art& art = art_[tag];
  const cv::Matx33d texel_from_plane(art.texels_per_m, 0, 0.5 * (art.ink_and_paper.cols - 1), 0,
                                     art.texels_per_m, 0.5 * (art.ink_and_paper.rows - 1), 0, 0, 1);
  const cv::Matx33d h = texel_from_plane * ray_from_plane(scene_.tags[tag], displacement).inv();
  cv::Mat samples;
  cv::remap(art.ink_and_paper, samples, through(h, rays), cv::noArray(), cv::INTER_LINEAR,
            cv::BORDER_CONSTANT);
  for (int y = 0; y < scene.rows; ++y) {
    const auto* over = samples.ptr<cv::Vec2f>(y);
    auto* sample = scene.ptr<float>(y);
    for (int x = 0; x < scene.cols; ++x) sample[x] = sample[x] * (1 - over[x][1]) + over[x][0];
  }
}

cv::Rect ArtRenderer::seen(const Vector6& displacement) const {
  std::vector<cv::Point2f> outline;
  for (std::size_t t = 0; t < scene_.tags.size(); ++t) {
    const double half = 0.5 * art_[t].ink_and_paper.cols / art_[t].texels_per_m;
    for (const cv::Point2d& corner : {cv::Point2d(-half, -half), cv::Point2d(half, -half),
                                      cv::Point2d(half, half), cv::Point2d(-half, half)})
      outline.push_back(project(scene_.tags[t], corner, displacement));
  }
  return cv::boundingRect(outline);
}

cv::Mat ArtRenderer::light(const Vector6& displacement) const {
  const double blur = scene_.blur_sigma_px;
  cv::Mat scene = plate(rays_, displacement);
  if (blur > 0)
    cv::GaussianBlur(scene, scene, {}, blur);  // the plate has nothing finer than pixels

  // Where the tags are, what the lens blurs is what the pixels then average, not the other way
  // about: else the blur would depend on where in a pixel an edge lies.
  const int reach = static_cast<int>(std::ceil(kBlurReach * blur)) + 2;
  const auto grown = [&](const cv::Rect& r, int by) {
    return cv::Rect(r.x - by, r.y - by, r.width + 2 * by, r.height + 2 * by) &
           cv::Rect(0, 0, scene.cols, scene.rows);
  };
  const cv::Rect shown = grown(seen(displacement), reach);
  if (!shown.empty()) {
    const cv::Rect drawn = grown(shown, reach);
    const cv::Mat rays = fine_rays_(cv::Rect(drawn.x * kSamples, drawn.y * kSamples,
                                             drawn.width * kSamples, drawn.height * kSamples));
    cv::Mat fine = plate(rays, displacement);
    for (std::size_t t = 0; t < scene_.tags.size(); ++t) draw_tag(t, displacement, rays, fine);
    if (blur > 0) cv::GaussianBlur(fine, fine, {}, blur * kSamples);
    cv::Mat pixels;
    cv::resize(fine, pixels, drawn.size(), 0, 0, cv::INTER_AREA);
    pixels(shown - drawn.tl()).copyTo(scene(shown));
  }
  for (int x = 0; x < scene.cols; ++x)
    scene.col(x) *= 1 - scene_.light_fall * x / (scene.cols - 1.0);
  return scene;
}

cv::Mat ArtRenderer::picture(const Vector6& displacement, std::uint64_t sequence) const {
  cv::Mat light = this->light(displacement);
  cv::Mat noise(light.size(), CV_32F);
  cv::RNG random(sequence + 1);
  random.fill(noise, cv::RNG::NORMAL, 0, scene_.noise_counts);
  light += noise;
  cv::Mat picture;
  light.convertTo(picture, CV_8U);
  return picture;
}

Vector6 art_displacement(const ArtScene& scene, int frame) {
  return compound_motion(scene.amplitude, (frame - kRestFrames) / scene.frame_rate);
}

std::string art_sensor_yaml(const ArtScene& s, bool true_geometry) {
  std::string text = fmt::format(
      "camera: {{width: {}, height: {}, fx: {}, fy: {}, cx: {}, cy: {}, distortion: [{}]}}\n"
      "target:\n  family: aruco_original\n  tag_size_mm: {}\n  border_mm: {}\n  tags:\n",
      s.width, s.height, s.f_px, s.f_px, s.cx_px, s.cy_px, fmt::join(s.distortion, ", "),
      1e3 * s.tag_size, 1e3 * s.border);
  const auto triple = [](const cv::Vec3d& v, double scale) {
    return fmt::format("[{}, {}, {}]", scale * v[0], scale * v[1], scale * v[2]);
  };
  for (const ArtTag& tag : s.tags) {
    text += fmt::format("    - {{id: {}", tag.id);
    if (true_geometry) {
      text += fmt::format(", position_mm: {}, rotation_rad: {}", triple(tag.position, 1e3),
                          triple(tag.rotation, 1));
    }
    text += "}\n";
  }
  text += fmt::format("rest: {{frames: {}", kRestFrames);
  if (true_geometry)
    text += fmt::format(", position_mm: {}, rotation_rad: [0, 0, 0]", triple(s.rest_position, 1e3));
  return text +
         "}\n"
         "wrench: {springs: {centres_mm: [[7.5, 6.5, -11], [-7.5, 6.5, -11], [7.5, -6.5, -11], "
         "[-7.5, -6.5, -11]],\n"
         "                   axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07},\n"
         "         range_n: [10, 10, 10], range_nm: [1, 1, 1]}\n";
}

void write_art_folder(const ArtScene& scene, const std::filesystem::path& folder, int frames,
                      bool true_geometry) {
  const ArtRenderer renderer(scene);
  const auto displacement = [&](int frame) { return art_displacement(scene, frame); };
  write_frame_folder({frames, scene.frame_rate, art_sensor_yaml(scene, true_geometry), displacement,
                      [&](int frame) {
                        return renderer.picture(displacement(frame),
                                                static_cast<std::uint64_t>(frame));
                      }},
                     folder);
}

}  // namespace tagwrench::test
