#include "host/tracker/refine.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kCoarseHalf_px = 9.0;
constexpr double kFineHalf_px = 6.0;
constexpr int kCoarseSteps = 4;
constexpr int kFineSteps = 5;
constexpr double kCoarseEnough_px = 1.0;  ///< a step below this ends the coarse stage
constexpr double kFineEnough_px = 0.03;   ///< and this the fine one: what is left is far smaller

/// Robust scales below these would throw away inliers, px.
constexpr double kCoarseMinScale_px = 0.7;
constexpr double kFineMinScale_px = 0.04;

constexpr int kMinPoints = 24;
constexpr double kMinInlierFraction = 0.5;  ///< of a tag's points, for the tag to be held
constexpr double kMinCellsInView = 0.6;     ///< of a tag's cells
constexpr double kMinCorrelation = 0.75;    ///< of cell grey levels with those expected

/// RMS residuals beyond these are doubted, px: a target learned at rest fits to noise, a bare
/// pattern to its print.
constexpr double kDoubtLearned_px = 0.4;
constexpr double kDoubtBare_px = 2.0;

/// A pose that is useful at all: in front of the lens and not absurdly far, m.
constexpr double kFarthest = 10.0;

/// Brings metres and radians to like size in the normal equations, m.
constexpr double kLengthScale = 5e-3;

bool sane(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d& t = pose.translation();
  return pose.matrix().allFinite() && t.z() > 0 && t.norm() < kFarthest;
}

}  // namespace

void Refiner::set_target(EdgeTarget target) {
  target_ = std::move(target);
  first_.assign(1, 0);
  for (const EdgeTag& tag : target_.tags) first_.push_back(first_.back() + tag.points.size());
  measurements_.assign(first_.back(), EdgeMeasurement{});
  scratch_.assign(first_.back(), 0.0F);
  excluded_.assign(target_.tags.size(), false);
}

std::span<EdgeMeasurement> Refiner::of_tag(std::size_t tag) noexcept {
  return std::span(measurements_).subspan(first_[tag], first_[tag + 1] - first_[tag]);
}

Refinement Refiner::refine(const ImageView& image, const Eigen::Isometry3d& predicted) noexcept {
  Refinement fit;
  if (image.pixels == nullptr || target_.tags.empty() || !sane(predicted)) return fit;
  fit.camera_T_platform = predicted;
  std::fill(excluded_.begin(), excluded_.end(), false);

  // Where tags are covered, their few stray points pulled at the fit: once more without them.
  int held = 0;
  for (int round = 0; round < 2 && held < static_cast<int>(target_.tags.size()); ++round) {
    if (!converge(image, fit)) return fit;
    held = judge_tags(image, fit);
    if (held == 0) return fit;
  }
  fit.tags_held = static_cast<std::uint8_t>(held);
  renormalise(fit.camera_T_platform);
  const double doubt_px = target_.residual_px > 0 ? kDoubtLearned_px : kDoubtBare_px;
  const bool accepted = fit.residual_px < doubt_px && is_precise(fit.covariance);
  fit.verdict = accepted ? Verdict::held : Verdict::doubtful;
  return fit;
}

bool Refiner::converge(const ImageView& image, Refinement& fit) noexcept {
  for (const bool coarse : {true, false}) {
    for (int i = 0; i < (coarse ? kCoarseSteps : kFineSteps); ++i) {
      const Step step = iterate(image, coarse, fit);
      if (!step.solved) return false;
      if (step.size_px < (coarse ? kCoarseEnough_px : kFineEnough_px)) break;
    }
  }
  return true;
}

Refiner::Step Refiner::iterate(const ImageView& image, bool coarse, Refinement& fit) noexcept {
  const double half_width_px = coarse ? kCoarseHalf_px : kFineHalf_px;
  for (std::size_t t = 0; t < target_.tags.size(); ++t) {
    if (excluded_[t]) {
      for (EdgeMeasurement& m : of_tag(t)) m.valid = false;
      continue;
    }
    meter_.measure(pixel_view(image), target_.tags[t], fit.camera_T_platform, half_width_px, coarse,
                   of_tag(t));
  }
  return solve(coarse ? kCoarseMinScale_px : kFineMinScale_px, fit);
}

/// Standard deviation of the valid offsets about zero, from their median: half of the points may be
/// wrong.
double Refiner::robust_scale_px() noexcept {
  std::size_t count = 0;
  for (const EdgeMeasurement& m : measurements_)
    if (m.valid) scratch_[count++] = static_cast<float>(std::abs(m.offset_px));
  if (count == 0) return 0;
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.begin() + static_cast<std::ptrdiff_t>(count));
  return kMadToSigma * static_cast<double>(*middle);
}

Refiner::Step Refiner::solve(double min_scale_px, Refinement& fit) noexcept {
  Vector6 units;
  units << Eigen::Vector3d::Constant(kLengthScale), Eigen::Vector3d::Ones();
  const double cut = kTukey95 * std::max(robust_scale_px(), min_scale_px);
  Matrix6 normal = Matrix6::Zero();
  Vector6 rhs = Vector6::Zero();
  double weights = 0;
  double gains = 0;
  int inliers = 0;
  for (EdgeMeasurement& m : measurements_) {
    m.weight = m.valid ? biweight(m.offset_px / cut) : 0;
    if (m.weight == 0) continue;
    ++inliers;
    weights += m.weight;
    gains += m.weight * m.gain;
    const Vector6 row = m.row.cwiseProduct(units);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, m.weight);
    rhs += m.weight * m.offset_px * row;
  }
  if (inliers < kMinPoints) return {};
  // All points share one gain: a single profile's is noisy.
  const double gain = std::clamp(gains / weights, 0.3, 1.3);
  const Matrix6 full = normal.selfadjointView<Eigen::Lower>();
  const Ldlt<6> ldlt(full);
  if (!ldlt.positive(1e-12)) return {};
  const Vector6 delta = (ldlt.solve(rhs) / gain).cwiseProduct(units);
  if (!delta.allFinite()) return {};

  double moved_px2 = 0;
  double residual_px2 = 0;
  for (const EdgeMeasurement& m : measurements_) {
    if (m.weight <= 0) continue;
    const double change = m.row.dot(delta);
    const double left = m.offset_px / gain - change;
    moved_px2 += m.weight * change * change;
    residual_px2 += m.weight * left * left;
  }
  const Eigen::Isometry3d next = moved(fit.camera_T_platform, delta);
  if (!sane(next)) return {};
  fit.camera_T_platform = next;
  const double variance_px2 = residual_px2 / std::max(1.0, weights - 6.0);
  fit.residual_px = std::sqrt(residual_px2 / weights);
  fit.covariance = variance_px2 * (units.asDiagonal() * ldlt.inverse() * units.asDiagonal());
  return {true, std::sqrt(moved_px2 / weights)};
}

/// Excludes the tags that the fit or their looks speak against; the number of those left.
int Refiner::judge_tags(const ImageView& image, const Refinement& fit) noexcept {
  int held = 0;
  for (std::size_t t = 0; t < target_.tags.size(); ++t) {
    if (excluded_[t]) continue;
    int inliers = 0;
    int measurable = 0;
    for (const EdgeMeasurement& m : of_tag(t)) {
      inliers += m.weight > 0.2 ? 1 : 0;
      measurable += m.too_near ? 0 : 1;
    }
    const bool enough = measurable > 0 && inliers >= kMinInlierFraction * measurable;
    excluded_[t] = !enough || !looks_like_tag(image, target_.tags[t], fit.camera_T_platform);
    held += excluded_[t] ? 0 : 1;
  }
  return held;
}

/// Correlation of the cells' grey levels with those expected: indifferent to gain and offset of the
/// light.
bool Refiner::looks_like_tag(const ImageView& image, const EdgeTag& tag,
                             const Eigen::Isometry3d& pose) noexcept {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (const CellPoint& cell : tag.cells) {
    const double a = meter_.cell_grey(pixel_view(image), tag, cell, pose);
    if (a < 0) continue;
    const auto b = static_cast<double>(cell.grey);
    n += 1;
    sa += a;
    sb += b;
    saa += a * a;
    sbb += b * b;
    sab += a * b;
  }
  if (n < kMinCellsInView * static_cast<double>(tag.cells.size())) return false;
  const double var_a = saa - sa * sa / n;
  const double var_b = sbb - sb * sb / n;
  if (!(var_a > n) || !(var_b > n)) return false;
  return (sab - sa * sb / n) > kMinCorrelation * std::sqrt(var_a * var_b);
}

}  // namespace tagwrench
