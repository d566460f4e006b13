#include "tests/unit/tracker/render.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::render {
namespace {

constexpr float kBackground = 110;
constexpr float kPaper = 205;
constexpr float kInk = 38;

struct Plane {
  const PrintedTag* tag;
  Eigen::Vector3d origin;
  Eigen::Matrix3d axes;  // columns x, y, normal
};

Eigen::Matrix3d turn(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, r / angle).toRotationMatrix()
                   : Eigen::Matrix3d::Identity().eval();
}

bool is_ink(const PrintedTag& tag, double x, double y) {
  const double cell = tag.size / static_cast<double>(tag.rows.size());
  const auto n = static_cast<double>(tag.rows.size());
  const auto black = [&](double sx, double sy) {
    const double column = std::floor((x + sx + tag.size / 2) / cell);
    const double row = std::floor((y + sy + tag.size / 2) / cell);
    if (column < 0 || row < 0 || column >= n || row >= n) return false;
    return tag.rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] == '#';
  };
  // Black grown by the spread: any point within it of black, along the axes.
  const double spread = tag.ink_spread;
  if (spread == 0) return black(0, 0);
  return black(-spread, -spread) || black(-spread, spread) || black(spread, -spread) ||
         black(spread, spread);
}

/// Grey level along the ray through normalised coordinates; false where the plane's paper is not
/// hit.
bool look(const Plane& plane, const Eigen::Vector3d& ray, float& level) {
  const Eigen::Vector3d normal = plane.axes.col(2);
  const double slope = normal.dot(ray);
  if (slope <= 1e-9) return false;
  const Eigen::Vector3d hit = ray * (normal.dot(plane.origin) / slope) - plane.origin;
  const double x = plane.axes.col(0).dot(hit);
  const double y = plane.axes.col(1).dot(hit);
  const double half = plane.tag->size / 2 + plane.tag->border;
  if (std::abs(x) > half || std::abs(y) > half) return false;
  level = is_ink(*plane.tag, x, y) ? kInk : kPaper;
  return true;
}

bool near_paper(const std::vector<Plane>& planes, const Eigen::Vector3d& ray) {
  return std::any_of(planes.begin(), planes.end(), [&ray](const Plane& plane) {
    const double slope = plane.axes.col(2).dot(ray);
    if (slope <= 1e-9) return false;
    const Eigen::Vector3d hit = ray * (plane.axes.col(2).dot(plane.origin) / slope) - plane.origin;
    // A pixel reaches much less than a tenth of a tag beyond its middle.
    const double reach = 0.6 * plane.tag->size + plane.tag->border;
    return std::abs(plane.axes.col(0).dot(hit)) < reach &&
           std::abs(plane.axes.col(1).dot(hit)) < reach;
  });
}

/// Inverse of the radial distortion by fixed-point iteration.
Eigen::Vector3d ray_of(const Scene& scene, double u, double v) {
  const double xd = (u - scene.cx_px) / scene.f_px;
  const double yd = (v - scene.cy_px) / scene.f_px;
  double x = xd;
  double y = yd;
  for (int i = 0; scene.k1 != 0 && i < 12; ++i) {
    const double stretch = 1 + scene.k1 * (x * x + y * y);
    const bool found = std::abs(xd - x * stretch) + std::abs(yd - y * stretch) < 1e-12;
    x = xd / stretch;
    y = yd / stretch;
    if (found) break;
  }
  return {x, y, 1};
}

void blur(std::vector<float>& image, int width, int height, double sigma_px) {
  if (sigma_px <= 0) return;
  const int reach = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<float> kernel;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
    sum += kernel.back();
  }
  const auto w = static_cast<std::size_t>(width);
  const auto add = [w](float* to, const float* from, float weight) {
    for (std::size_t x = 0; x < w; ++x) to[x] += weight * from[x];
  };
  std::vector<float> other(image.size());
  std::vector<float> padded(w + 2 * static_cast<std::size_t>(reach));
  for (int y = 0; y < height; ++y) {
    const float* row = &image[static_cast<std::size_t>(y) * w];
    for (int x = -reach; x < width + reach; ++x)
      padded[static_cast<std::size_t>(x + reach)] = row[std::clamp(x, 0, width - 1)];
    float* to = &other[static_cast<std::size_t>(y) * w];
    for (std::size_t i = 0; i < kernel.size(); ++i) add(to, &padded[i], kernel[i]);
    for (std::size_t x = 0; x < w; ++x) to[x] /= sum;
  }
  std::fill(image.begin(), image.end(), 0.0F);
  for (int y = 0; y < height; ++y) {
    float* to = &image[static_cast<std::size_t>(y) * w];
    for (int i = -reach; i <= reach; ++i) {
      const int from = std::clamp(y + i, 0, height - 1);
      add(to, &other[static_cast<std::size_t>(from) * w],
          kernel[static_cast<std::size_t>(i + reach)]);
    }
    for (std::size_t x = 0; x < w; ++x) to[x] /= sum;
  }
}

}  // namespace

PrintedTag tag_five() {
  PrintedTag tag;
  tag.rows = {"#######", "#.#####", "#.#####", "#.#####", "#.#...#", "#.#...#", "#######"};
  return tag;
}

PrintedTag tag_two() {
  PrintedTag tag;
  tag.rows = {"#######", "#.#####", "#.#####", "#.#####", "#.#####", "##.##.#", "#######"};
  return tag;
}

PrintedTag april_seven() {
  PrintedTag tag;
  tag.rows = {"########", "###.#.##", "#...####", "##...#.#",
              "###.#.##", "##..####", "###.####", "########"};
  return tag;
}

Scene roof() {
  Scene scene;
  scene.tags = {tag_five(), tag_two()};
  // Axes are turned about x by 45 degrees, then a little more, as hands do.
  scene.tags[0].camera_T_tag.linear() = turn({0.78, 0.02, -0.03}) * turn({0, 0.01, 0.02});
  scene.tags[1].camera_T_tag.linear() = turn({-0.80, -0.03, 0.02});
  scene.tags[0].camera_T_tag.translation() = Eigen::Vector3d(0.0001, -0.00175, 0.0211);
  scene.tags[1].camera_T_tag.translation() = Eigen::Vector3d(-0.00015, 0.0017, 0.0209);
  scene.pivot =
      0.5 * (scene.tags[0].camera_T_tag.translation() + scene.tags[1].camera_T_tag.translation());
  return scene;
}

Scene alone(const PrintedTag& tag) {
  Scene scene;
  scene.tags = {tag};
  scene.tags[0].camera_T_tag.linear() = turn({0.5, 0.3, 0.1});
  scene.tags[0].camera_T_tag.translation() = Eigen::Vector3d(0.0005, -0.0004, 0.021);
  scene.pivot = scene.tags[0].camera_T_tag.translation();
  return scene;
}

std::vector<float> expose(const Scene& scene, const Vector6& displacement) {
  const Eigen::Matrix3d rotation = turn(displacement.tail<3>());
  std::vector<Plane> planes;
  for (const PrintedTag& tag : scene.tags) {
    Plane plane;
    plane.tag = &tag;
    plane.origin = rotation * (tag.camera_T_tag.translation() - scene.pivot) + scene.pivot +
                   displacement.head<3>();
    plane.axes = rotation * tag.camera_T_tag.linear();
    planes.push_back(plane);
  }
  std::vector<float> image(static_cast<std::size_t>(scene.width * scene.height));
  const int n = scene.supersample;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      float sum = 0;
      if (!near_paper(planes, ray_of(scene, u, v))) {
        image[static_cast<std::size_t>(v * scene.width + u)] = kBackground;
        continue;
      }
      for (int i = 0; i < n * n; ++i) {
        // No two samples in one row or column: edges along either get n * n levels.
        const double du = (i % n + (i / n + 0.5) / n) / n - 0.5;
        const double dv = (i / n + (i % n + 0.5) / n) / n - 0.5;
        const Eigen::Vector3d ray = ray_of(scene, u + du, v + dv);
        float level = kBackground;
        for (const Plane& plane : planes) {
          if (look(plane, ray, level)) break;
        }
        sum += level;
      }
      image[static_cast<std::size_t>(v * scene.width + u)] = sum / static_cast<float>(n * n);
    }
  }
  blur(image, scene.width, scene.height, scene.blur_px);
  return image;
}

Picture develop(const Scene& scene, const std::vector<float>& image, std::mt19937& random) {
  Picture picture{scene.width, scene.height, std::vector<std::uint8_t>(image.size())};
  std::normal_distribution<float> noise(0, static_cast<float>(std::max(scene.noise, 1e-9)));
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const int column = scene.mirrored ? scene.width - 1 - u : u;
      const float level = image[static_cast<std::size_t>(v * scene.width + u)] + noise(random);
      picture.pixels[static_cast<std::size_t>(v * scene.width + column)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  }
  return picture;
}

Picture take(const Scene& scene, const Vector6& displacement, std::mt19937& random) {
  return develop(scene, expose(scene, displacement), random);
}

}  // namespace tagwrench::render
