#include "host/tracker/rest_fit.h"

#include <algorithm>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kHalf_px = 6.0;  // as the fine stage of the refinement
/// Of the pose: longer profiles reach the paper's edge and take the tag for tilted.
constexpr double kPoseHalf_px = 3.5;
constexpr int kIterations = 15;
/// Half of the edges inside go the other way than the outline where ink has spread: they must be
/// heard before they are taken for outliers.
constexpr int kOpenIterations = 4;
constexpr double kOpenCut_px = 4;
constexpr int kClusterPoints = 12;  // in a row, of three cells' sides
constexpr int kOffsetPasses = 3;
constexpr double kMaxOffset_px = 2.0;
constexpr double kMinContrastFraction = 0.3;  // of the tag's median
constexpr double kMinFraction = 0.5;          // of a tag's points
constexpr double kMinScale_px = 0.05;
constexpr double kLengthScale = 5e-3;  // m per unit of translation in the normal equations
constexpr double kSpreadScale = 1e-4;  // m
constexpr double kPartScale = 0.05;

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

/// How far edges are seen off their places, robust standard deviation.
struct EdgeScatter {
  double px = kMinScale_px;
  double metres = 0;  ///< in the tag's plane
};

EdgeScatter edge_scatter(const Measurements& all) {
  std::vector<double> px, metres;
  for (const auto& tag : all) {
    const double gain = median_gain(tag);
    for (const EdgeMeasurement& m : tag) {
      if (!m.valid) continue;
      px.push_back(std::abs(m.offset_px));
      metres.push_back(std::abs(m.offset_px) / gain / m.px_per_m);
    }
  }
  return {std::max(kMinScale_px, kMadToSigma * median(std::move(px))),
          kMadToSigma * median(std::move(metres))};
}

PrintModes print_units() {
  PrintModes units;
  units << kSpreadScale, kSpreadScale, kPartScale, kPartScale, kPartScale;
  return units;
}

/// Unknowns: six of the pose, then the print modes of each tag.
class PrintFit {
 public:
  PrintFit(const EdgeMeter& meter, const PixelView<float>& image, double size, EdgeTarget& target,
           RestFit& fit)
      : meter_(meter),
        image_(image),
        size_(size),
        pattern_(target),
        target_(target),
        fit_(fit),
        tags_(static_cast<Eigen::Index>(target.tags.size())),
        units_(6 + kPrintModes * tags_) {
    units_ << Eigen::Vector3d::Constant(kLengthScale), Eigen::Vector3d::Ones(),
        print_units().replicate(tags_, 1);
    fit.print.assign(target.tags.size(), PrintModes::Zero());
  }

  /// False when the equations have no solution. `open`: no edge is an outlier yet.
  bool iterate(bool open) {
    const Measurements all = measure_all(meter_, image_, target_, fit_.camera_T_platform);
    const EdgeScatter scatter = edge_scatter(all);
    fit_.scatter = scatter.metres;
    Equations sum = summed(all, std::max(kTukey95 * scatter.px, open ? kOpenCut_px : 0.0));
    if (!(sum.count > 0)) return false;
    const double point_variance = std::max(sum.squares / sum.count, kMinScale_px * kMinScale_px);
    const double variance = point_variance * alike_;
    add_prior(sum, variance);
    const Ldlt<Eigen::Dynamic> ldlt(sum.normal);
    if (!ldlt.positive(1e-12)) return false;
    const Eigen::VectorXd step = ldlt.solve(sum.rhs).cwiseProduct(units_);
    if (!step.allFinite()) return false;
    judge(sum, ldlt.inverse(), variance, point_variance);
    take(step);
    return true;
  }

 private:
  struct Equations {
    Eigen::MatrixXd normal;
    Eigen::VectorXd rhs;
    /// What neighbouring points have in common (ragged ink, a neighbour's blur) moves the fit more
    /// than noise of the same size: the sandwich estimator for clustered errors, three cells'
    /// sides each.
    Eigen::MatrixXd meat;
    double clusters = 0;
    double squares = 0;  ///< px^2, weighted
    double count = 0;    ///< sum of weights
  };

  Equations summed(const Measurements& all, double cut) const {
    const Eigen::Index unknowns = units_.size();
    Equations sum;
    sum.normal = sum.meat = Eigen::MatrixXd::Zero(unknowns, unknowns);
    sum.rhs = Eigen::VectorXd::Zero(unknowns);
    Eigen::VectorXd row(unknowns);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(unknowns);
    int in_cluster = 0;
    for (std::size_t t = 0; t < all.size(); ++t) {
      const double gain = median_gain(all[t]);
      for (std::size_t p = 0; p < all[t].size(); ++p) {
        const EdgeMeasurement& m = all[t][p];
        const double weight = m.valid ? biweight(m.offset_px / cut) : 0;
        if (weight == 0) continue;
        row.setZero();
        row.head<6>() = m.row;
        row.segment<kPrintModes>(print_index(t)) =
            m.px_per_m * print_row(pattern_.tags[t].points[p]);
        row.array() *= units_.array();
        const double offset = m.offset_px / gain;
        const Eigen::VectorXd own_pull = weight * offset * row;
        sum.normal += weight * row * row.transpose();
        sum.rhs += own_pull;
        pull += own_pull;
        sum.squares += weight * offset * offset;
        sum.count += weight;
        if (++in_cluster < kClusterPoints) continue;
        sum.meat += pull * pull.transpose();
        pull.setZero();
        in_cluster = 0;
        sum.clusters += 1;
      }
    }
    return sum;
  }

  /// What prints usually do, in the equations' units: as if one point's variance were 1.
  void add_prior(Equations& sum, double variance) const {
    const PrintModes weight = variance * print_units().cwiseQuotient(print_prior()).cwiseAbs2();
    for (std::size_t t = 0; t < fit_.print.size(); ++t) {
      const Eigen::Index at = print_index(t);
      sum.normal.diagonal().segment<kPrintModes>(at) += weight;
      sum.rhs.segment<kPrintModes>(at) -=
          weight.cwiseProduct(fit_.print[t].cwiseQuotient(print_units()));
    }
  }

  /// The covariance, and how many of a cluster's points err together.
  void judge(const Equations& sum, const Eigen::MatrixXd& inverse, double variance,
             double point_variance) {
    const auto unknowns = static_cast<double>(units_.size());
    const double few = sum.clusters > unknowns ? sum.clusters / (sum.clusters - unknowns) : 10.0;
    Eigen::MatrixXd meat = few * sum.meat;
    alike_ = std::clamp((inverse * meat).trace() / unknowns / point_variance, 1.0,
                        static_cast<double>(kClusterPoints));
    // The prior's pull, of a print as bad as this one may be.
    const PrintModes prior_pull = variance * print_units()
                                                 .cwiseQuotient(print_prior())
                                                 .cwiseProduct(print_sigma(fit_.scatter, size_))
                                                 .cwiseQuotient(print_prior());
    meat.diagonal().tail(kPrintModes * tags_) += prior_pull.cwiseAbs2().replicate(tags_, 1);
    fit_.covariance = (units_.asDiagonal() * (inverse * meat * inverse) * units_.asDiagonal())
                          .topLeftCorner<6, 6>();
  }

  void take(const Eigen::VectorXd& step) {
    fit_.camera_T_platform = moved(fit_.camera_T_platform, step.head<6>());
    for (std::size_t t = 0; t < fit_.print.size(); ++t) {
      fit_.print[t] += step.segment<kPrintModes>(print_index(t));
      for (std::size_t p = 0; p < pattern_.tags[t].points.size(); ++p) {
        const EdgePoint& printed = pattern_.tags[t].points[p];
        target_.tags[t].points[p] = shifted(printed, print_row(printed).dot(fit_.print[t]));
      }
    }
  }

  static Eigen::Index print_index(std::size_t tag) {
    return 6 + kPrintModes * static_cast<Eigen::Index>(tag);
  }

  const EdgeMeter& meter_;
  const PixelView<float>& image_;
  double size_;
  EdgeTarget pattern_;
  EdgeTarget& target_;
  RestFit& fit_;
  Eigen::Index tags_;
  Eigen::VectorXd units_;
  double alike_ = kClusterPoints;
};

}  // namespace

bool fit_pose_and_print(const EdgeMeter& meter, const PixelView<float>& image, double size,
                        EdgeTarget& target, RestFit& fit) {
  PrintFit solver(meter, image, size, target, fit);
  for (int i = 0; i < kIterations; ++i)
    if (!solver.iterate(i < kOpenIterations)) return false;
  renormalise(fit.camera_T_platform);
  return fit.camera_T_platform.matrix().allFinite() && fit.camera_T_platform.translation().z() > 0;
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
      const double gain = median_gain(measured);
      for (std::size_t i = 0; i < before; ++i) {
        if (!measured[i].valid) continue;
        const double step_px = std::clamp(measured[i].offset_px / gain, -0.5, 0.5);
        moved_px[i] += step_px;
        tag.points[i] = shifted(tag.points[i], step_px / measured[i].px_per_m);
      }
    }
    meter.measure(image, tag, camera_T_platform, kHalf_px, false, measured);
    const double least = kMinContrastFraction * median_contrast(measured);
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
        static_cast<double>(kept.size()) < kMinFraction * static_cast<double>(measurable))
      return false;
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
