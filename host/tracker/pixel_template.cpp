#include "host/tracker/pixel_template.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "host/tracker/acquire.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Of the quintic spline's prefilter (Unser, Aldroubi, Eden, "B-spline signal processing", IEEE TSP
/// 41(2), 1993).
constexpr std::array<double, 2> kPoles = {-0.430575347099973791851, -0.0430962882032646535};

/// Turns samples into spline coefficients, in place.
void prefilter(float* line, int count, std::ptrdiff_t step, std::vector<double>& work) {
  if (count < 2) return;
  constexpr int kHorizon = 24;  // |pole|^24 is below float's resolution
  work.resize(static_cast<std::size_t>(count));
  double gain = 1;
  for (const double pole : kPoles) gain *= (1 - pole) * (1 - 1 / pole);
  for (int i = 0; i < count; ++i) work[static_cast<std::size_t>(i)] = gain * line[i * step];
  const std::size_t last = work.size() - 1;
  for (const double pole : kPoles) {
    double first = 0;
    double power = 1;
    for (int i = 0; i < std::min(kHorizon, count); ++i, power *= pole)
      first += power * work[static_cast<std::size_t>(i)];
    work[0] = first;
    for (std::size_t i = 1; i <= last; ++i) work[i] += pole * work[i - 1];
    work[last] = pole / (pole * pole - 1) * (pole * work[last - 1] + work[last]);
    for (std::size_t i = last; i-- > 0;) work[i] = pole * (work[i + 1] - work[i]);
  }
  for (int i = 0; i < count; ++i)
    line[i * step] = static_cast<float>(work[static_cast<std::size_t>(i)]);
}

constexpr int kTaps = 6;

double quintic(double x) {
  const double a = std::abs(x);
  const double b = a * a;
  if (a < 1) return 11.0 / 20 + b * (-0.5 + b * (0.25 - a / 12));
  if (a < 2)
    return 17.0 / 40 + a * (5.0 / 8 + a * (-7.0 / 4 + a * (5.0 / 4 + a * (-3.0 / 8 + a / 24))));
  if (a < 3)
    return 81.0 / 40 + a * (-27.0 / 8 + a * (9.0 / 4 + a * (-3.0 / 4 + a * (1.0 / 8 - a / 120))));
  return 0;
}

/// Of the coefficients from two before to three after, `t` past the middle one.
std::array<double, kTaps> weights(double t) {
  std::array<double, kTaps> out;
  for (int i = 0; i < kTaps; ++i) out[static_cast<std::size_t>(i)] = quintic(t - (i - 2));
  return out;
}

constexpr int kGrid = 7;  // samples along a side of the pixel's area

using Fit = Eigen::Matrix<double, 10, kGrid * kGrid>;

double offset(int i) { return (i + 0.5) / kGrid - 0.5; }

Fit make_fit() {
  Eigen::Matrix<double, kGrid * kGrid, 10> basis;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) {
      const double x = offset(i);
      const double y = offset(j);
      basis.row(j * kGrid + i) << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y,
          y * y * y;
    }
  }
  return (basis.transpose() * basis).ldlt().solve(basis.transpose());
}

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
  // Turned about where nothing of the square is in the image.
  Eigen::AlignedBox2d seen(Eigen::Vector2d(camera.width_px, camera.height_px),
                           Eigen::Vector2d(0, 0));
  for (const Eigen::Vector3d& corner : square_corners(plane.half)) {
    const ProjectedPoint p = project(camera, plane.camera_T_tag * corner);
    if (!p.valid) return {};
    seen.extend(p.pixel);
  }
  const auto within = [](double v, int margin, int end) {
    return std::clamp(static_cast<int>(v) + margin, 0, end);
  };
  return {within(std::floor(seen.min().x()), -kMargin_px, camera.width_px),
          within(std::floor(seen.min().y()), -kMargin_px, camera.height_px),
          within(std::ceil(seen.max().x()), kMargin_px, camera.width_px),
          within(std::ceil(seen.max().y()), kMargin_px, camera.height_px)};
}

/// Rows of a rectangle of a picture, without padding.
std::vector<float> cut_out(const PixelView<float>& image, const Box& box) {
  std::vector<float> out;
  out.reserve(static_cast<std::size_t>(box.width()) * static_cast<std::size_t>(box.height()));
  for (int row = box.top; row < box.bottom; ++row) {
    const float* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    out.insert(out.end(), from + box.left, from + box.right);
  }
  return out;
}

class Builder {
 public:
  Builder(const CameraModel& camera, const PixelView<float>& mean, int frames,
          const PixelNoise& noise, const Eigen::Isometry3d& camera_T_platform,
          const PixelTemplateOptions& options)
      : noise_(noise),
        options_(options),
        mean_depth_(camera_T_platform.translation().z()),
        mean_(mean) {
    out_.camera = raw_camera(camera);
    out_.camera_T_platform = camera_T_platform;
    out_.frames = frames;
  }

  void add_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag) {
    const TagPlane plane{out_.camera_T_platform * platform_T_tag,
                         0.5 * pattern.size + kBorderUsed * pattern.border};
    const Box box = box_of(out_.camera, plane);
    tags_.push_back({platform_T_tag, plane, box,
                     SplineImage(cut_out(mean_, box), box.left, box.top, std::max(1, box.width()),
                                 std::max(1, box.height()))});
    for (int y = box.top + 2; y < box.bottom - 2; ++y)
      for (int x = box.left + 2; x < box.right - 2; ++x) consider(tags_.size() - 1, x, y);
  }

  PixelTemplate finish() {
    choose();
    out_.tags = tags_.size();
    float darkest = 255, brightest = 0;
    for (const Candidate& c : candidates_) {
      darkest = std::min(darkest, at(c.x, c.y));
      brightest = std::max(brightest, at(c.x, c.y));
    }
    out_.contrast = std::max(1.0F, brightest - darkest);
    std::size_t at = 0;
    while (at < candidates_.size()) {
      std::size_t end = at;
      while (end < candidates_.size() && candidates_[end].tag == candidates_[at].tag &&
             candidates_[end].patch == candidates_[at].patch)
        ++end;
      add_patch(std::span(candidates_).subspan(at, end - at));
      at = end;
    }
    return std::move(out_);
  }

 private:
  float at(int x, int y) const {
    return mean_.pixels[static_cast<std::ptrdiff_t>(y) * mean_.stride + x];
  }

  std::optional<Eigen::Vector2d> on_tag(std::size_t tag, double x, double y) const {
    const auto ray = unproject(out_.camera, {x, y});
    return ray ? tags_[tag].plane.meet(*ray) : std::nullopt;
  }

  void consider(std::size_t tag, int x, int y) {
    const double half = tags_[tag].plane.half;
    const auto place = on_tag(tag, x, y);
    if (!place || place->cwiseAbs().maxCoeff() > half) return;
    for (int j = -2; j <= 2; ++j) {
      for (int i = -2; i <= 2; ++i)
        if (at(x + i, y + j) > kSaturated) return;
    }
    const double gx = 0.5 * (at(x + 1, y) - at(x - 1, y));
    const double gy = 0.5 * (at(x, y + 1) - at(x, y - 1));
    const auto cell = [&](double v) {
      return std::clamp(static_cast<int>((v / half + 1) / 2 * kPatchesPerSide), 0,
                        kPatchesPerSide - 1);
    };
    candidates_.push_back({.x = x,
                           .y = y,
                           .tag = tag,
                           .patch = cell(place->y()) * kPatchesPerSide + cell(place->x()),
                           .information = (gx * gx + gy * gy) / noise_.variance(at(x, y)),
                           .on_tag = *place});
  }

  /// Keeps the pixels that tell most, in the order of patches and then of memory.
  void choose() {
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return a.information > b.information; });
    double all = 0;
    for (const Candidate& c : candidates_) all += c.information;
    double sum = 0;
    std::size_t keep = 0;
    while (keep < std::min(candidates_.size(), options_.max_pixels) &&
           sum < options_.min_information * all)
      sum += candidates_[keep++].information;
    candidates_.resize(keep);
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.tag, a.patch, a.y, a.x) < std::tie(b.tag, b.patch, b.y, b.x);
    });
  }

  Eigen::Vector3d platform_point(std::size_t tag, const Eigen::Vector2d& on_tag_m) const {
    return tags_[tag].platform_T_tag * Eigen::Vector3d(on_tag_m.x(), on_tag_m.y(), 0);
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
    const PixelPolynomial level = tags_[c.tag].spline.polynomial(c.x, c.y);
    const Eigen::Vector3d p = platform_point(c.tag, c.on_tag);
    const double weight = 1.0 / std::sqrt(noise_.variance(level[0]));
    const double laplacian = 2.0 * (level[3] + level[5]);
    const double depth = ((out_.camera_T_platform * p).z() - mean_depth_) / kDepthUnit;
    const Box& box = tags_[c.tag].box;
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
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          sum += (2 - std::abs(i)) * (2 - std::abs(j)) * at_clamped(cx + i, cy + j);
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
  PixelView<float> mean_;
  struct Tag {
    Eigen::Isometry3d platform_T_tag;
    TagPlane plane;
    Box box;
    SplineImage spline;
  };
  std::vector<Tag> tags_;
  std::vector<Candidate> candidates_;
};

}  // namespace

SplineImage::SplineImage(std::vector<float> levels, int left, int top, int width, int height)
    : coefficients_(std::move(levels)), left_(left), top_(top), width_(width), height_(height) {
  std::vector<double> work;
  for (int row = 0; row < height; ++row)
    prefilter(coefficients_.data() + static_cast<std::ptrdiff_t>(row) * width, width, 1, work);
  for (int column = 0; column < width; ++column)
    prefilter(coefficients_.data() + column, height, width, work);
}

double SplineImage::coefficient(int column, int row) const {
  column = std::clamp(column, 0, width_ - 1);
  row = std::clamp(row, 0, height_ - 1);
  return coefficients_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(column)];
}

double SplineImage::level(double x, double y) const {
  x -= left_;
  y -= top_;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const std::array<double, kTaps> wx = weights(x - column);
  const std::array<double, kTaps> wy = weights(y - row);
  double sum = 0;
  for (int j = 0; j < kTaps; ++j) {
    double line = 0;
    for (int i = 0; i < kTaps; ++i)
      line += wx[static_cast<std::size_t>(i)] * coefficient(column + i - 2, row + j - 2);
    sum += wy[static_cast<std::size_t>(j)] * line;
  }
  return sum;
}

PixelPolynomial SplineImage::polynomial(int x, int y) const {
  static const Fit fit = make_fit();
  Eigen::Matrix<double, kGrid * kGrid, 1> levels;
  for (int j = 0; j < kGrid; ++j)
    for (int i = 0; i < kGrid; ++i) levels[j * kGrid + i] = level(x + offset(i), y + offset(j));
  PixelPolynomial out;
  Eigen::Map<Eigen::Matrix<double, 10, 1>>(out.data()) = fit * levels;
  return out;
}

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
  for (std::size_t t = 0; t < target.tags.size(); ++t)
    builder.add_tag(patterns[t], target.tags[t].platform_T_tag);
  return builder.finish();
}

}  // namespace tagwrench
