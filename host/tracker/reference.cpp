#include "host/tracker/reference.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/print_check.h"
#include "host/tracker/rest_fit.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Motion of the tags' corners that spoils the average, px: a fifth of the blur would still be
/// harmless.
constexpr double kMoved_px = 0.5;
/// Root mean square from where less is not told from noise, px: edges are found to a few
/// hundredths.
constexpr double kSway_px = 0.1;

/// Light, blur and profiles of finite length displace edges by about this much, px; scatter does
/// not show it.
constexpr double kEdgeBias_px = 0.015;

Matrix6 centre_covariance(const Eigen::Isometry3d& camera_T_tag) {
  const Eigen::Matrix<double, 3, 2> plane = camera_T_tag.linear().leftCols<2>();
  Matrix6 covariance = Matrix6::Zero();
  covariance.topLeftCorner<3, 3>() = kPrintCentre * kPrintCentre * (plane * plane.transpose());
  return covariance;
}

constexpr double kMinLikeness = 0.7;  // glare over a quarter of a tag leaves more
constexpr double kMinSeen = 0.5;      // of a tag's cells
constexpr double kMinContrast = 4;    // grey levels, standard deviation over the cells

/// Grey level at a pixel of the image after flipping back; empty outside.
std::optional<double> level_at(const ReferenceImage& image, bool mirrored,
                               const Eigen::Vector2d& pixel) {
  if (!(pixel.x() > -0.5 && pixel.x() < image.width - 0.5 && pixel.y() > -0.5 &&
        pixel.y() < image.height - 0.5))
    return std::nullopt;
  const auto column = static_cast<int>(std::lround(pixel.x()));
  const auto row = static_cast<int>(std::lround(pixel.y()));
  const int stored = mirrored ? image.width - 1 - column : column;
  return image.level[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(stored)];
}

/// Of the cells within the black frame, which all tags share.
double likeness(const CameraModel& camera, const ReferenceImage& image, const TagPattern& pattern,
                const Eigen::Isometry3d& camera_T_tag) {
  const double cell = pattern.size / pattern.cells;
  Eigen::ArrayXd levels(pattern.cells * pattern.cells);
  Eigen::ArrayXd printed(levels.size());
  Eigen::Index seen = 0;
  for (int row = 1; row < pattern.cells - 1; ++row) {
    for (int column = 1; column < pattern.cells - 1; ++column) {
      const Eigen::Vector3d middle((column + 0.5) * cell - 0.5 * pattern.size,
                                   (row + 0.5) * cell - 0.5 * pattern.size, 0);
      const ProjectedPoint at = project(camera, camera_T_tag * middle);
      const auto level =
          at.valid ? level_at(image, camera.mirrored, at.pixel) : std::optional<double>();
      if (!level) continue;
      levels[seen] = *level;
      printed[seen++] = pattern.is_white(row, column) ? 1 : 0;
    }
  }
  const int inside = pattern.cells - 2;
  if (static_cast<double>(seen) < kMinSeen * inside * inside) return 0;
  const Eigen::ArrayXd a = levels.head(seen) - levels.head(seen).mean();
  const Eigen::ArrayXd b = printed.head(seen) - printed.head(seen).mean();
  if (!(std::sqrt(a.square().mean()) > kMinContrast)) return 0;
  const double size = std::sqrt(a.square().sum() * b.square().sum());
  return size > 0 ? (a * b).sum() / size : 0;
}

}  // namespace

void RestSway::add(const Vector6& motion, double motion_px, bool counted) {
  ++frames_;
  squares_px_ += motion_px * motion_px;
  sum_ += motion;
  squares_ += motion * motion.transpose();
  if (!counted) return;
  ++counted_;
  counted_sum_ += motion;
}

Matrix6 RestSway::covariance() const {
  if (counted_ == 0 || squares_px_ < frames_ * kSway_px * kSway_px) return Matrix6::Zero();
  const Vector6 mean = counted_sum_ / counted_;
  const Vector6 all = sum_ / frames_;
  return squares_ / frames_ - mean * all.transpose() - all * mean.transpose() +
         mean * mean.transpose();
}

ReferenceEstimator::ReferenceEstimator(const CameraModel& camera, const TargetDescription& target,
                                       const ReferenceOptions& options,
                                       const std::vector<TagPattern>& patterns)
    : camera_(camera),
      description_(target),
      options_(options),
      patterns_(patterns),
      meter_(camera),
      single_(camera),
      joint_(camera) {}

ReferenceEstimator::Progress ReferenceEstimator::add(const ImageView& image,
                                                     const Finding& finding) {
  if (frames_ == 0) {
    if (!start(image, finding)) {
      held_ = 0;
      return Progress::waiting;
    }
    apart_ = 0;
    sway_.begin();
    sway_.add(Vector6::Zero(), 0, true);
  } else {
    const Refinement fit = joint_.refine(image, last_pose_);
    tags_seen_ = fit.tags_held;
    if (fit.verdict != Verdict::held || fit.tags_held != description_.tags.size()) {
      frames_ = held_ = 0;
      return Progress::waiting;
    }
    last_pose_ = fit.camera_T_platform;
    const double way_px = motion_px(last_pose_);
    const bool near = way_px <= kMoved_px;
    sway_.add(motion_between(first_pose_, last_pose_), way_px, near);
    ++held_;
    apart_ = near ? 0 : apart_ + 1;
    if (!near && sways() && apart_ < least_frames()) return Progress::swaying;
    if (!near) {
      frames_ = 0;
      return Progress::moved;
    }
  }
  accumulate(image);
  if (frames_ < least_frames()) return Progress::learning;
  const bool learned = finish();
  frames_ = held_ = 0;
  return learned ? Progress::done : Progress::waiting;
}

bool ReferenceEstimator::start(const ImageView& image, const Finding& finding) {
  tags_seen_ = static_cast<int>(finding.tags.size());
  if (finding.tags.size() != description_.tags.size()) return false;
  std::vector<Eigen::Isometry3d> camera_T_tag(description_.tags.size());
  for (const FoundTag& found : finding.tags) {
    const std::optional<Eigen::Isometry3d> pose = tag_pose(image, found);
    if (!pose) return false;
    camera_T_tag[found.index] = *pose;
  }
  if (!place(camera_T_tag)) return false;
  joint_.set_target(learned_.target);
  const Refinement fit =
      joint_.refine(image, by_given_tag(camera_T_tag).value_or(learned_.camera_T_platform));
  if (fit.verdict != Verdict::held || fit.tags_held != description_.tags.size()) return false;
  first_pose_ = last_pose_ = fit.camera_T_platform;
  return true;
}

/// Of the two poses that four corners allow, the edges of the whole tag choose one.
std::optional<Eigen::Isometry3d> ReferenceEstimator::tag_pose(const ImageView& image,
                                                              const FoundTag& found) {
  single_.set_target({{make_edge_tag(patterns_[found.index], Eigen::Isometry3d::Identity())}, 0});
  std::optional<Eigen::Isometry3d> best;
  double least_px = 1e9;
  for (const Eigen::Isometry3d& candidate : found.camera_T_tag) {
    const Refinement fit = single_.refine(image, candidate);
    if (fit.verdict != Verdict::held || fit.residual_px >= least_px) continue;
    if (fit.camera_T_platform.linear().col(2).dot(fit.camera_T_platform.translation()) <= 0)
      continue;
    best = fit.camera_T_platform;
    least_px = fit.residual_px;
  }
  return best;
}

/// The platform frame and the tags in it, as far as the description leaves them open; fills
/// learned_.
bool ReferenceEstimator::place(const std::vector<Eigen::Isometry3d>& camera_T_tag) {
  const Eigen::Isometry3d camera_T_platform =
      options_.camera_T_platform
          ? *options_.camera_T_platform
          : by_given_tag(camera_T_tag).value_or(midpoint_frame(camera_T_tag));
  learned_.camera_T_platform = camera_T_platform;
  learned_.target = {};
  for (std::size_t t = 0; t < camera_T_tag.size(); ++t) {
    const auto& given = description_.tags[t].platform_T_tag;
    const Eigen::Isometry3d platform_T_tag =
        given ? *given : camera_T_platform.inverse() * camera_T_tag[t];
    learned_.target.tags.push_back(make_edge_tag(patterns_[t], platform_T_tag));
  }
  return camera_T_platform.matrix().allFinite();
}

/// Where the platform is by the first tag whose place is given, which need not be where the
/// reference was given.
std::optional<Eigen::Isometry3d> ReferenceEstimator::by_given_tag(
    const std::vector<Eigen::Isometry3d>& camera_T_tag) const {
  for (std::size_t t = 0; t < camera_T_tag.size(); ++t) {
    const auto& given = description_.tags[t].platform_T_tag;
    if (given) return camera_T_tag[t] * given->inverse();
  }
  return std::nullopt;
}

void ReferenceEstimator::accumulate(const ImageView& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const std::size_t pixels = width * static_cast<std::size_t>(image.height);
  if (frames_ == 0) {
    sum_.assign(pixels, 0.0F);
    squares_.assign(pixels, 0.0F);
    previous_.assign(pixels, 0);
  }
  for (int row = 0; row < image.height; ++row) {
    const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    const std::size_t first = static_cast<std::size_t>(row) * width;
    for (std::size_t column = 0; column < width; ++column) {
      const auto level = static_cast<float>(from[column]);
      const float change = level - static_cast<float>(previous_[first + column]);
      sum_[first + column] += level;
      if (frames_ > 0) squares_[first + column] += change * change;
      previous_[first + column] = from[column];
    }
  }
  ++frames_;
}

/// RMS motion of the tags' centres and edges in the image since the first frame.
double ReferenceEstimator::motion_px(const Eigen::Isometry3d& camera_T_platform) const {
  double squares = 0, count = 0;
  for (const EdgeTag& tag : joint_.target().tags) {
    for (const EdgePoint& point : tag.points) {
      const Eigen::Vector3d p = tag.platform_T_tag * Eigen::Vector3d(point.x, point.y, 0);
      const ProjectedPoint before = project(camera_, first_pose_ * p);
      const ProjectedPoint now = project(camera_, camera_T_platform * p);
      if (!before.valid || !now.valid) continue;
      squares += (now.pixel - before.pixel).squaredNorm();
      count += 1;
    }
  }
  return std::sqrt(squares / std::max(1.0, count));
}

/// Variance against level: medians over bins of levels, so that what moved counts little, and a
/// straight line through them.
PixelNoise ReferenceEstimator::measure_noise() const {
  constexpr std::size_t kBins = 16;
  constexpr std::size_t kMin = 100;       // pixels in a bin
  constexpr double kMedianToMean = 1.03;  // of a chi-squared with some 20 degrees of freedom
  constexpr std::size_t kEvery = 7;       // pixels looked at
  if (frames_ < 4) return {};
  std::array<std::vector<double>, kBins> bins;
  for (std::size_t i = 0; i < sum_.size(); i += kEvery) {
    const double level = sum_[i];
    const auto bin = static_cast<std::size_t>(level / (256.0 / kBins));
    bins[std::min(bin, kBins - 1)].push_back(squares_[i] / (2.0 * (frames_ - 1)));
  }
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d rhs = Eigen::Vector2d::Zero();
  for (std::size_t b = 0; b + 1 < kBins; ++b) {  // the last one saturates
    if (bins[b].size() < kMin) continue;
    const auto weight = static_cast<double>(bins[b].size());
    const double variance = kMedianToMean * median(std::move(bins[b]));
    const Eigen::Vector2d row(1, (static_cast<double>(b) + 0.5) * (256.0 / kBins));
    normal += weight * row * row.transpose();
    rhs += weight * variance * row;
  }
  if (!(normal(0, 0) > 0)) return {};
  PixelNoise noise{rhs[0] / normal(0, 0), 0};
  if (normal.determinant() > 1e-6 * normal(0, 0) * normal(1, 1)) {
    const Eigen::Vector2d line = normal.inverse() * rhs;
    if (line[0] > 0 && line[1] > 0) noise = {line[0], line[1]};
  }
  return noise;
}

/// Larger and nearer look alike but for the bits inside: what shifts all edges outward by a little
/// is taken for distance.
Matrix6 ReferenceEstimator::distance_covariance(const Eigen::Isometry3d& camera_T_body) const {
  const Eigen::Vector3d sight = camera_T_body.translation();
  const double per_px = sight.norm() / (0.5 * camera_.fx_px * description_.tag_size);
  Matrix6 covariance = Matrix6::Zero();
  covariance.topLeftCorner<3, 3>() =
      std::pow(kEdgeBias_px * per_px, 2) * (sight * sight.transpose());
  return covariance;
}

/// All displacements of given tags are seen over a distance that the picture tells: by its fit, and
/// by how far apart the tags are, of which paper and glue leave a little open.
double ReferenceEstimator::seen_scale_sigma(const Eigen::Isometry3d& camera_T_platform) const {
  const Eigen::Vector3d sight = camera_T_platform.translation().normalized();
  const double variance = sight.dot(learned_.pose_covariance.topLeftCorner<3, 3>() * sight) /
                          camera_T_platform.translation().squaredNorm();
  double open = 0, apart = 0;  // m^2
  for (const Tag& tag : description_.tags) {
    if (!tag.platform_T_tag) continue;
    open += kPrintCentre * kPrintCentre + tag.sigma.head<3>().squaredNorm() / 3;
    apart += tag.platform_T_tag->translation().squaredNorm();
  }
  const double size = 0.5 * description_.tag_size;  // of a single tag
  const auto tags = static_cast<double>(description_.tags.size());
  return std::sqrt(variance + open / std::max(apart, size * size) / tags);
}

bool ReferenceEstimator::finish() {
  const float scale = 1.0F / static_cast<float>(frames_);
  for (float& level : sum_) level *= scale;
  learned_.noise = measure_noise();
  learned_.sway = sway_.covariance();
  const PixelView<float> mean{sum_.data(), camera_.width_px, camera_.height_px, camera_.width_px};

  // Every tag by itself, from where the joint fit has it.
  std::vector<Eigen::Isometry3d> camera_T_tag;
  std::vector<EdgeTag> printed;
  std::vector<Matrix6> tag_covariance;
  double scale_sigma = 0;
  for (std::size_t t = 0; t < patterns_.size(); ++t) {
    EdgeTarget alone{{make_edge_tag(patterns_[t], Eigen::Isometry3d::Identity())}, 0};
    RestFit fit;
    fit.camera_T_platform = last_pose_ * joint_.target().tags[t].platform_T_tag;
    if (!fit_pose_and_print(meter_, mean, description_.tag_size, alone, fit)) return false;
    Matrix6 covariance = fit.covariance + distance_covariance(fit.camera_T_platform);
    scale_sigma =
        std::max(scale_sigma, print_size_sigma(fit.scatter, fit.spread(), description_.tag_size));
    tag_covariance.push_back(covariance);
    camera_T_tag.push_back(fit.camera_T_platform);
    printed.push_back(std::move(alone.tags.front()));
  }
  if (!place(camera_T_tag)) return false;
  bool any_given = false;
  for (std::size_t t = 0; t < printed.size(); ++t) {
    any_given = any_given || description_.tags[t].platform_T_tag.has_value();
    learned_.target.tags[t].points = std::move(printed[t].points);
  }
  Eigen::Isometry3d fitted = learned_.camera_T_platform;
  learned_.scale_sigma = scale_sigma;
  if (any_given) {
    // Given tags make one rigid body: they and the reference pose are fitted together, and the open
    // ones placed by it.
    EdgeTarget given;
    for (std::size_t t = 0; t < patterns_.size(); ++t) {
      const EdgeTag& tag = learned_.target.tags[t];
      if (description_.tags[t].platform_T_tag)
        given.tags.push_back(make_edge_tag(patterns_[t], tag.platform_T_tag));
    }
    RestFit fit;
    fit.camera_T_platform = last_pose_;
    if (!fit_pose_and_print(meter_, mean, description_.tag_size, given, fit)) return false;
    fitted = fit.camera_T_platform;
    learned_.pose_covariance = fit.covariance + distance_covariance(fitted);
    if (!options_.camera_T_platform) learned_.camera_T_platform = fitted;
    for (std::size_t t = 0; t < patterns_.size(); ++t) {
      if (description_.tags[t].platform_T_tag)
        tag_covariance[t] = tagwrench::tag_covariance(
            description_.tags[t], (fitted * learned_.target.tags[t].platform_T_tag).linear());
      else
        learned_.target.tags[t].platform_T_tag = fitted.inverse() * camera_T_tag[t];
    }
    learned_.scale_sigma = std::hypot(description_.scale_sigma, seen_scale_sigma(fitted));
  }
  for (std::size_t t = 0; t < tag_covariance.size(); ++t)
    tag_covariance[t] += centre_covariance(camera_T_tag[t]);
  if (!learn_appearance(meter_, mean, learned_.target, fitted)) return false;
  learned_.tag_covariance = std::move(tag_covariance);
  learned_.seen_from = fitted;
  learned_.image = {mean.width, mean.height, frames_, std::move(sum_)};
  return true;
}

std::optional<AppearanceMismatch> check_appearance(const CameraModel& camera,
                                                   const TargetDescription& target,
                                                   const ReferenceOptions& reference) {
  if (!reference.appearance || !reference.camera_T_platform) return std::nullopt;
  const ReferenceImage& picture = *reference.appearance;
  std::vector<TagPattern> patterns;
  for (const Tag& tag : target.tags)
    patterns.push_back(tag_pattern(target.family, tag.id, target.tag_size, target.border));
  const PrintCheck prints(camera, target.family, patterns);
  for (std::size_t t = 0; t < patterns.size(); ++t) {
    const Tag& tag = target.tags[t];
    if (!tag.platform_T_tag) continue;
    const Eigen::Isometry3d camera_T_tag = *reference.camera_T_platform * *tag.platform_T_tag;
    const double found = likeness(camera, picture, patterns[t], camera_T_tag);
    const PrintReading print = prints.read(
        {picture.level.data(), picture.width, picture.height, picture.width}, t, camera_T_tag);
    if (print.verdict == PrintReading::Verdict::other)
      return AppearanceMismatch{tag.id, found, print.other_id};
    if (!(found >= kMinLikeness)) return AppearanceMismatch{tag.id, found};
  }
  return std::nullopt;
}

}  // namespace tagwrench
