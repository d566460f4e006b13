#include "host/tracker/pixel_template.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "host/tracker/projection.h"
#include "host/tracker/rotation.h"
#include "host/tracker/spline_image.h"

namespace tagwrench {
namespace {

constexpr double kBorderUsed = 1.05;  // of the white margin: the paper's edge tells as well
constexpr double kSaturated = 250.0;  // grey level
constexpr int kMargin_px = 8;         // around the tags, for the spline
constexpr double kMinVariance = 0.1;  // rounding alone makes 1/12

struct Candidate {
  int x = 0, y = 0;
  std::size_t tag = 0;
  int patch = 0;
  double information = 0;
  Eigen::Vector2d on_tag;  // m
};

/// A ray meets a tag's plane: the point in the tag's axes.
struct TagPlane {
  Eigen::Isometry3d camera_T_tag;
  double half = 0;  // m, of the square that is used

  std::optional<Eigen::Vector2d> meet(const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d normal = camera_T_tag.linear().col(2);
    const double along = normal.dot(ray);
    if (!(along > 1e-6)) return std::nullopt;
    const double depth = normal.dot(camera_T_tag.translation()) / along;
    if (!(depth > kNearest)) return std::nullopt;
    const Eigen::Vector3d p = camera_T_tag.inverse() * Eigen::Vector3d(depth * ray);
    return p.head<2>();
  }
};

struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;  // exclusive at right and bottom
  int width() const { return right - left; }
  int height() const { return bottom - top; }
};

/// The pixels that may see the square, clipped to the image.
Box box_of(const CameraModel& camera, const TagPlane& plane) {
  double left = camera.width_px, top = camera.height_px, right = 0, bottom = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const double sx = corner == 0 || corner == 3 ? -1 : 1;
    const double sy = corner < 2 ? -1 : 1;
    const ProjectedPoint p =
        project(camera, plane.camera_T_tag * Eigen::Vector3d(sx * plane.half, sy * plane.half, 0));
    if (!p.valid) return {};
    left = std::min(left, p.pixel.x());
    right = std::max(right, p.pixel.x());
    top = std::min(top, p.pixel.y());
    bottom = std::max(bottom, p.pixel.y());
  }
  Box box;
  box.left = std::clamp(static_cast<int>(std::floor(left)) - kMargin_px, 0, camera.width_px);
  box.right = std::clamp(static_cast<int>(std::ceil(right)) + kMargin_px, 0, camera.width_px);
  box.top = std::clamp(static_cast<int>(std::floor(top)) - kMargin_px, 0, camera.height_px);
  box.bottom = std::clamp(static_cast<int>(std::ceil(bottom)) + kMargin_px, 0, camera.height_px);
  return box;
}

std::vector<float> cut_out(const std::vector<float>& image, int stride, const Box& box) {
  std::vector<float> out;
  out.reserve(static_cast<std::size_t>(box.width()) * static_cast<std::size_t>(box.height()));
  for (int row = box.top; row < box.bottom; ++row) {
    const auto from = image.begin() + static_cast<std::ptrdiff_t>(row) * stride;
    out.insert(out.end(), from + box.left, from + box.right);
  }
  return out;
}

class Builder {
 public:
  Builder(const CameraModel& camera, const PixelView<float>& mean, int frames,
          const PixelNoise& noise, const Eigen::Isometry3d& camera_T_platform,
          const PixelTemplateOptions& options)
      : noise_(noise), options_(options), mean_depth_(camera_T_platform.translation().z()) {
    out_.camera = raw_camera(camera);
    out_.camera_T_platform = camera_T_platform;
    out_.frames = frames;
    image_.reserve(static_cast<std::size_t>(mean.width) * static_cast<std::size_t>(mean.height));
    for (int row = 0; row < mean.height; ++row) {
      const float* from = mean.pixels + static_cast<std::ptrdiff_t>(row) * mean.stride;
      image_.insert(image_.end(), from, from + mean.width);
    }
  }

  void add_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag) {
    const std::size_t tag = planes_.size();
    TagPlane plane{out_.camera_T_platform * platform_T_tag,
                   0.5 * pattern.size + kBorderUsed * pattern.border};
    planes_.push_back(plane);
    platform_T_tag_.push_back(platform_T_tag);
    const Box box = box_of(out_.camera, plane);
    boxes_.push_back(box);
    splines_.emplace_back(cut_out(image_, out_.camera.width_px, box), box.left, box.top,
                          std::max(1, box.width()), std::max(1, box.height()));
    for (int y = box.top + 2; y < box.bottom - 2; ++y) {
      for (int x = box.left + 2; x < box.right - 2; ++x) consider(tag, x, y);
    }
  }

  PixelTemplate finish() {
    choose();
    out_.tags = planes_.size();
    float darkest = 255;
    float brightest = 0;
    for (const Candidate& c : candidates_) {
      darkest = std::min(darkest, at(c.x, c.y));
      brightest = std::max(brightest, at(c.x, c.y));
    }
    out_.contrast = std::max(1.0F, brightest - darkest);
    std::size_t at = 0;
    while (at < candidates_.size()) {
      std::size_t end = at;
      while (end < candidates_.size() && candidates_[end].tag == candidates_[at].tag &&
             candidates_[end].patch == candidates_[at].patch) {
        ++end;
      }
      add_patch(std::span(candidates_).subspan(at, end - at));
      at = end;
    }
    return std::move(out_);
  }

 private:
  float at(int x, int y) const {
    return image_[static_cast<std::size_t>(y) * static_cast<std::size_t>(out_.camera.width_px) +
                  static_cast<std::size_t>(x)];
  }

  std::optional<Eigen::Vector2d> on_tag(std::size_t tag, double x, double y) const {
    const auto ray = unproject(out_.camera, {x, y});
    return ray ? planes_[tag].meet(*ray) : std::nullopt;
  }

  void consider(std::size_t tag, int x, int y) {
    const double half = planes_[tag].half;
    const auto place = on_tag(tag, x, y);
    if (!place || place->cwiseAbs().maxCoeff() > half) return;
    for (int j = -2; j <= 2; ++j) {
      for (int i = -2; i <= 2; ++i) {
        if (at(x + i, y + j) > kSaturated) return;
      }
    }
    const double gx = 0.5 * (at(x + 1, y) - at(x - 1, y));
    const double gy = 0.5 * (at(x, y + 1) - at(x, y - 1));
    Candidate c;
    c.x = x;
    c.y = y;
    c.tag = tag;
    c.on_tag = *place;
    const auto cell = [&](double v) {
      return std::clamp(static_cast<int>((v / half + 1) / 2 * kPatchesPerSide), 0,
                        kPatchesPerSide - 1);
    };
    c.patch = cell(place->y()) * kPatchesPerSide + cell(place->x());
    c.information = (gx * gx + gy * gy) / noise_.variance(at(x, y));
    candidates_.push_back(c);
  }

  /// Keeps the pixels that tell most, in the order of patches and then of memory.
  void choose() {
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return a.information > b.information; });
    double all = 0;
    for (const Candidate& c : candidates_) all += c.information;
    double sum = 0;
    std::size_t keep = 0;
    while (keep < std::min(candidates_.size(), options_.most_pixels) &&
           sum < options_.least_information * all) {
      sum += candidates_[keep++].information;
    }
    candidates_.resize(keep);
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.tag, a.patch, a.y, a.x) < std::tie(b.tag, b.patch, b.y, b.x);
    });
  }

  Eigen::Vector3d platform_point(std::size_t tag, const Eigen::Vector2d& on_tag_m) const {
    return platform_T_tag_[tag] * Eigen::Vector3d(on_tag_m.x(), on_tag_m.y(), 0);
  }

  void add_patch(std::span<const Candidate> pixels) {
    PixelPatch patch;
    patch.first = out_.size();
    patch.tag = pixels.front().tag;
    patch.row = static_cast<std::size_t>(pixels.front().patch / kPatchesPerSide);
    patch.column = static_cast<std::size_t>(pixels.front().patch % kPatchesPerSide);
    patch.pixels = pixels.size();
    Eigen::Vector2d middle(0, 0);
    for (const Candidate& c : pixels) middle += Eigen::Vector2d(c.x, c.y);
    middle /= static_cast<double>(pixels.size());
    const auto point = [&](double dx, double dy) {
      const auto place = on_tag(patch.tag, middle.x() + dx, middle.y() + dy);
      return platform_point(patch.tag, place.value_or(pixels.front().on_tag));
    };
    patch.middle = point(0, 0);
    patch.right = point(1, 0);
    patch.below = point(0, 1);
    for (const Candidate& c : pixels) {
      add_pixel(c, patch);
      patch.mean_noise +=
          std::sqrt(noise_.variance(at(c.x, c.y))) / static_cast<double>(pixels.size());
      patch.reach_px =
          std::max({patch.reach_px, std::abs(c.x - middle.x()), std::abs(c.y - middle.y())});
    }
    while (out_.size() % kRun != 0) pad();
    patch.count = out_.size() - patch.first;
    out_.patches.push_back(patch);
  }

  void add_pixel(const Candidate& c, PixelPatch& patch) {
    const PixelPolynomial level = splines_[c.tag].polynomial(c.x, c.y);
    const Eigen::Vector3d p = platform_point(c.tag, c.on_tag);
    const double weight = 1.0 / std::sqrt(noise_.variance(level[0]));
    const double laplacian = 2.0 * (level[3] + level[5]);
    const double depth = ((out_.camera_T_platform * p).z() - mean_depth_) / kDepthUnit;
    const Box& box = boxes_[c.tag];
    const double across = 2.0 * (c.x - box.left) / box.width() - 1;
    const double down = 2.0 * (c.y - box.top) / box.height() - 1;

    const Eigen::Vector2d gradient = weight * Eigen::Vector2d(level[1], level[2]);
    Eigen::Matrix<double, kNuisanceParameters, 1> nuisance;
    nuisance << laplacian, depth * laplacian, level[0], across * level[0], down * level[0],
        down * down * level[0], 1;
    nuisance *= weight;
    patch.gradient += gradient * gradient.transpose();
    patch.gradient_nuisance += gradient * nuisance.transpose();
    patch.nuisance += nuisance * nuisance.transpose();

    out_.x.push_back(static_cast<float>(p.x()));
    out_.y.push_back(static_cast<float>(p.y()));
    out_.z.push_back(static_cast<float>(p.z()));
    for (std::size_t k = 0; k < level.size(); ++k)
      out_.level[k].push_back(static_cast<float>(level[k]));
    out_.weight.push_back(static_cast<float>(weight));
    out_.depth.push_back(static_cast<float>(depth));
    out_.bilaplacian.push_back(static_cast<float>(bilaplacian(c.x, c.y)));
    out_.across.push_back(static_cast<float>(across));
    out_.down.push_back(static_cast<float>(down));
  }

  void pad() {
    for (PixelArray* array : {&out_.x, &out_.y, &out_.z, &out_.across, &out_.down, &out_.depth})
      array->push_back(array->back());  // projects to somewhere sensible
    for (PixelArray& array : out_.level) array.push_back(0);
    for (PixelArray* array : {&out_.weight, &out_.bilaplacian}) array->push_back(0);
  }

  /// Two Laplacians after the binomial filter (1 2 1) / 4 both ways, without which they would
  /// amplify noise some 25 times.
  double bilaplacian(int x, int y) const {
    const auto smooth = [&](int cx, int cy) {
      double sum = 0;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i)
          sum += (2 - std::abs(i)) * (2 - std::abs(j)) * at_clamped(cx + i, cy + j);
      }
      return sum / 16;
    };
    const auto laplacian = [&](int cx, int cy) {
      return smooth(cx + 1, cy) + smooth(cx - 1, cy) + smooth(cx, cy + 1) + smooth(cx, cy - 1) -
             4 * smooth(cx, cy);
    };
    return laplacian(x + 1, y) + laplacian(x - 1, y) + laplacian(x, y + 1) + laplacian(x, y - 1) -
           4 * laplacian(x, y);
  }

  double at_clamped(int x, int y) const {
    return at(std::clamp(x, 0, out_.camera.width_px - 1),
              std::clamp(y, 0, out_.camera.height_px - 1));
  }

  PixelNoise noise_;
  PixelTemplateOptions options_;
  double mean_depth_;
  PixelTemplate out_;
  std::vector<float> image_;
  std::vector<TagPlane> planes_;
  std::vector<Eigen::Isometry3d> platform_T_tag_;
  std::vector<Box> boxes_;
  std::vector<SplineImage> splines_;
  std::vector<Candidate> candidates_;
};

}  // namespace

double PixelNoise::variance(double level) const {
  return std::max(kMinVariance, constant + slope * level);
}

CameraModel raw_camera(const CameraModel& camera) {
  CameraModel raw = camera;
  if (camera.mirrored) {
    raw.fx_px = -camera.fx_px;
    raw.cx_px = camera.width_px - 1 - camera.cx_px;
    raw.mirrored = false;
  }
  return raw;
}

PixelTemplate make_pixel_template(const CameraModel& camera, const PixelView<float>& mean,
                                  int frames, const PixelNoise& noise,
                                  std::span<const TagPattern> patterns, const EdgeTarget& target,
                                  const Eigen::Isometry3d& camera_T_platform,
                                  const PixelTemplateOptions& options) {
  Builder builder(camera, mean, frames, noise, camera_T_platform, options);
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    builder.add_tag(patterns[t], target.tags[t].platform_T_tag);
  }
  return builder.finish();
}

}  // namespace tagwrench
