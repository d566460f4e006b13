#include "host/tracker/reference.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/tracker/appearance.h"
#include "host/tracker/projection.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Motion of the tags' corners that spoils the average, px: a fifth of the blur would still be
/// harmless.
constexpr double kMoved_px = 0.5;

/// Light, blur and profiles of finite length displace edges by about this much, px; scatter does
/// not show it.
constexpr double kEdgeBias_px = 0.015;

}  // namespace

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
    if (!start(image, finding)) return Progress::waiting;
  } else {
    const Refinement fit = joint_.refine(pixel_view(image), last_pose_);
    tags_seen_ = fit.tags_held;
    const bool all = fit.verdict == Verdict::held && fit.tags_held == description_.tags.size();
    const bool has_moved = all && motion_px(fit.camera_T_platform) > kMoved_px;
    if (!all || has_moved) {
      frames_ = 0;
      return has_moved ? Progress::moved : Progress::waiting;
    }
    last_pose_ = fit.camera_T_platform;
  }
  accumulate(image);
  if (frames_ < std::max(1, options_.frames)) return Progress::learning;
  const bool learned = finish();
  frames_ = 0;
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
  const Refinement fit = joint_.refine(pixel_view(image), seen_from(camera_T_tag));
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
    const Refinement fit = single_.refine(pixel_view(image), candidate);
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
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  bool placed = false;
  if (options_.camera_T_platform) {
    camera_T_platform = *options_.camera_T_platform;
    placed = true;
  } else {
    for (std::size_t t = 0; t < camera_T_tag.size() && !placed; ++t) {
      const auto& given = description_.tags[t].platform_T_tag;
      if (!given) continue;
      camera_T_platform = camera_T_tag[t] * given->inverse();
      placed = true;
    }
  }
  if (!placed) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Eigen::Isometry3d& pose : camera_T_tag) centre += pose.translation();
    camera_T_platform.translation() = centre / static_cast<double>(camera_T_tag.size());
  }
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

/// Where the platform is, which need not be where the reference was given.
Eigen::Isometry3d ReferenceEstimator::seen_from(
    const std::vector<Eigen::Isometry3d>& camera_T_tag) const {
  for (std::size_t t = 0; t < camera_T_tag.size(); ++t) {
    const auto& given = description_.tags[t].platform_T_tag;
    if (given) return camera_T_tag[t] * given->inverse();
  }
  return learned_.camera_T_platform;
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
  double squares = 0;
  double count = 0;
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
    const auto middle = bins[b].begin() + static_cast<std::ptrdiff_t>(bins[b].size() / 2);
    std::nth_element(bins[b].begin(), middle, bins[b].end());
    const double variance = kMedianToMean * *middle;
    const Eigen::Vector2d row(1, (static_cast<double>(b) + 0.5) * (256.0 / kBins));
    const auto weight = static_cast<double>(bins[b].size());
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

bool ReferenceEstimator::finish() {
  const float scale = 1.0F / static_cast<float>(frames_);
  for (float& level : sum_) level *= scale;
  learned_.noise = measure_noise();
  const PixelView<float> mean{sum_.data(), camera_.width_px, camera_.height_px, camera_.width_px};

  // Every tag by itself, from where the joint fit has it.
  std::vector<Eigen::Isometry3d> camera_T_tag;
  std::vector<EdgeTag> spread;
  std::vector<Matrix6> tag_covariance;
  for (std::size_t t = 0; t < patterns_.size(); ++t) {
    Eigen::Isometry3d pose = last_pose_ * joint_.target().tags[t].platform_T_tag;
    EdgeTarget alone{{make_edge_tag(patterns_[t], Eigen::Isometry3d::Identity())}, 0};
    Matrix6 covariance;
    if (!fit_pose_and_spread(meter_, mean, alone, pose, covariance)) return false;
    covariance += distance_covariance(pose);
    if (description_.tags[t].platform_T_tag)
      covariance = description_.tags[t].sigma.cwiseAbs2().asDiagonal();
    tag_covariance.push_back(covariance);
    camera_T_tag.push_back(pose);
    spread.push_back(std::move(alone.tags.front()));
  }
  if (!place(camera_T_tag)) return false;
  bool any_given = false;
  for (std::size_t t = 0; t < spread.size(); ++t) {
    any_given = any_given || description_.tags[t].platform_T_tag.has_value();
    learned_.target.tags[t].points = std::move(spread[t].points);
  }
  Eigen::Isometry3d fitted = learned_.camera_T_platform;
  if (any_given) {
    // Given tags make one rigid body: they and the reference pose are fitted together, and the open
    // ones placed by it.
    EdgeTarget given;
    for (std::size_t t = 0; t < patterns_.size(); ++t) {
      if (description_.tags[t].platform_T_tag) given.tags.push_back(learned_.target.tags[t]);
    }
    fitted = last_pose_;
    Matrix6 covariance;
    if (!fit_pose_and_spread(meter_, mean, given, fitted, covariance)) return false;
    learned_.pose_covariance = covariance + distance_covariance(fitted);
    if (!options_.camera_T_platform) learned_.camera_T_platform = fitted;
    for (std::size_t t = 0; t < patterns_.size(); ++t) {
      if (!description_.tags[t].platform_T_tag) {
        learned_.target.tags[t].platform_T_tag = fitted.inverse() * camera_T_tag[t];
      }
    }
  }
  if (!learn_appearance(meter_, mean, learned_.target, fitted)) return false;
  learned_.tag_covariance = std::move(tag_covariance);
  learned_.seen_from = fitted;
  learned_.image = {mean.width, mean.height, frames_, std::move(sum_)};
  return true;
}

}  // namespace tagwrench
