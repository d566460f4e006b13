#include "host/tracker/appearance.h"

#include <algorithm>
#include <cmath>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kHalf_px = 6.0;  // as the fine stage of the refinement
/// Of the pose: longer profiles reach the paper's edge and take the tag for tilted.
constexpr double kPoseHalf_px = 3.5;
constexpr int kSpreadIterations = 15;
constexpr int kClusterPoints = 12;  // in a row, of three cells' sides
constexpr int kOffsetPasses = 3;
constexpr double kMaxOffset_px = 2.0;
constexpr float kMinContrastFraction = 0.3F;  // of the tag's median
constexpr double kMinFraction = 0.5;          // of a tag's points
constexpr double kTukey = 4.685;
constexpr double kMinScale_px = 0.05;
constexpr double kLengthScale = 5e-3;    // m per unit of translation in the normal equations
constexpr double kSpreadScale = 1e-4;    // m
constexpr double kSpreadPrior_px = 1.0;  // keeps a spread that the pattern cannot tell near zero

using Measurements = std::vector<std::vector<EdgeMeasurement>>;

Measurements measure_all(const EdgeMeter& meter, const PixelView<float>& image,
                         const EdgeTarget& target, const Eigen::Isometry3d& pose) {
  Measurements all;
  for (const EdgeTag& tag : target.tags) {
    all.emplace_back(tag.points.size());
    meter.measure(image, tag, pose, kPoseHalf_px, false, all.back());
  }
  return all;
}

double robust_cut(const Measurements& all) {
  std::vector<double> offsets;
  for (const auto& tag : all) {
    for (const EdgeMeasurement& m : tag) {
      if (m.valid) offsets.push_back(std::abs(m.offset_px));
    }
  }
  return kTukey * std::max(kMinScale_px, kMadToSigma * median(std::move(offsets)));
}

double common_gain(const std::vector<EdgeMeasurement>& tag) {
  std::vector<double> gains;
  for (const EdgeMeasurement& m : tag) {
    if (m.valid) gains.push_back(m.gain);
  }
  return std::clamp(median(std::move(gains)), 0.3, 1.3);
}

}  // namespace

bool fit_pose_and_spread(const EdgeMeter& meter, const PixelView<float>& image, EdgeTarget& target,
                         Eigen::Isometry3d& camera_T_platform, Matrix6& covariance) {
  const auto tags = static_cast<Eigen::Index>(target.tags.size());
  Eigen::VectorXd units(6 + tags);
  units << Eigen::Vector3d::Constant(kLengthScale), Eigen::Vector3d::Ones(),
      Eigen::VectorXd::Constant(tags, kSpreadScale);
  for (int i = 0; i < kSpreadIterations; ++i) {
    const Measurements all = measure_all(meter, image, target, camera_T_platform);
    const double cut = robust_cut(all);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(6 + tags, 6 + tags);
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(6 + tags);
    Eigen::VectorXd row(6 + tags);
    // What neighbouring points have in common (ragged ink, a neighbour's blur) moves the fit more
    // than noise of the same size: the sandwich estimator for clustered errors, three cells'
    // sides each.
    Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(6 + tags, 6 + tags);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(6 + tags);
    int in_cluster = 0;
    double clusters = 0;
    for (Eigen::Index t = 0; t < tags; ++t) {
      const auto& tag = all[static_cast<std::size_t>(t)];
      const double gain = common_gain(tag);
      for (const EdgeMeasurement& m : tag) {
        const double q = m.offset_px / cut;
        if (!m.valid || q * q >= 1) continue;
        const double weight = (1 - q * q) * (1 - q * q);
        row.setZero();
        row.head<6>() = m.row;
        row[6 + t] = m.px_per_m;
        row.array() *= units.array();
        normal += weight * row * row.transpose();
        rhs += weight * (m.offset_px / gain) * row;
        pull += weight * (m.offset_px / gain) * row;
        if (++in_cluster == kClusterPoints) {
          meat += pull * pull.transpose();
          pull.setZero();
          in_cluster = 0;
          ++clusters;
        }
      }
    }
    for (Eigen::Index t = 0; t < tags; ++t) {
      const auto& tag = all[static_cast<std::size_t>(t)];
      const double px = tag.empty() ? 1.0 : tag.front().px_per_m * kSpreadScale / kSpreadPrior_px;
      normal(6 + t, 6 + t) += px * px * 1e-3;
    }
    const Ldlt<Eigen::Dynamic> ldlt(normal);
    if (!ldlt.positive(1e-12)) return false;
    const Eigen::VectorXd step = ldlt.solve(rhs).cwiseProduct(units);
    if (!step.allFinite()) return false;
    camera_T_platform = moved(camera_T_platform, step.head<6>());
    const auto parameters = static_cast<double>(6 + tags);
    const Eigen::MatrixXd inverse = ldlt.inverse();
    const double few = clusters > parameters ? clusters / (clusters - parameters) : 10.0;
    covariance = few * (units.asDiagonal() * (inverse * meat * inverse) * units.asDiagonal())
                           .topLeftCorner<6, 6>();
    for (Eigen::Index t = 0; t < tags; ++t) {
      for (EdgePoint& point : target.tags[static_cast<std::size_t>(t)].points)
        point = shifted(point, step[6 + t]);
    }
  }
  renormalise(camera_T_platform);
  return camera_T_platform.matrix().allFinite() && camera_T_platform.translation().z() > 0;
}

bool learn_appearance(const EdgeMeter& meter, const PixelView<float>& image, EdgeTarget& target,
                      const Eigen::Isometry3d& camera_T_platform) {
  double squares = 0;
  double count = 0;
  for (EdgeTag& tag : target.tags) {
    const std::size_t before = tag.points.size();
    std::vector<double> moved_px(before, 0.0);
    std::vector<EdgeMeasurement> measured(before);
    for (int pass = 0; pass < kOffsetPasses; ++pass) {
      meter.measure(image, tag, camera_T_platform, kHalf_px, false, measured);
      const double gain = common_gain(measured);
      for (std::size_t i = 0; i < before; ++i) {
        if (!measured[i].valid) continue;
        const double step_px = std::clamp(measured[i].offset_px / gain, -0.5, 0.5);
        moved_px[i] += step_px;
        tag.points[i] = shifted(tag.points[i], step_px / measured[i].px_per_m);
      }
    }
    meter.measure(image, tag, camera_T_platform, kHalf_px, false, measured);
    std::vector<double> contrasts;
    for (const EdgeMeasurement& m : measured) {
      if (m.valid) contrasts.push_back(m.contrast);
    }
    const double least = kMinContrastFraction * median(std::move(contrasts));
    std::vector<EdgePoint> kept;
    std::size_t measurable = 0;  // a narrow white margin leaves nothing of the outer edge
    for (std::size_t i = 0; i < before; ++i) {
      const EdgeMeasurement& m = measured[i];
      measurable += m.too_near ? 0 : 1;
      if (!m.valid || m.contrast < least || std::abs(moved_px[i]) > kMaxOffset_px) continue;
      kept.push_back(tag.points[i]);
      kept.back().contrast = static_cast<float>(m.contrast);
      squares += moved_px[i] * moved_px[i];
      count += 1;
    }
    if (kept.empty() ||
        static_cast<double>(kept.size()) < kMinFraction * static_cast<double>(measurable)) {
      return false;
    }
    tag.points = std::move(kept);
    for (CellPoint& cell : tag.cells) {
      const double grey = meter.cell_grey(image, tag, cell, camera_T_platform);
      if (grey >= 0) cell.grey = static_cast<float>(grey);
    }
  }
  target.residual_px = std::sqrt(squares / std::max(1.0, count));
  return true;
}

}  // namespace tagwrench
