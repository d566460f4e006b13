#include "host/calibration/target/adjust.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/calibration/target/equations.h"
#include "host/calibration/target/observations.h"
#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr int kMaxIterations = 40;
constexpr double kUsualSteps = 16;  // both fits together, for the progress that is told
constexpr double kStill = 0.2;      // sigmas of the shared unknowns together, to be the end
constexpr double kNearlyStill = 1;  // where it will not get better
constexpr int kLearningSteps = 10;
constexpr double kLeastPart = 0.125;
constexpr int kSmallParts = 4;
constexpr double kMaxFocalStep = 0.03;  // a longer step is shortened, with all that goes with it

/// What keeps the focal length from being known better than this, as a part of it, however many
/// pictures there are: shading, change of blur.
constexpr double kFocalModel = 0.002;
/// And the read-out time: a picture's velocity is the mean over two steps.
constexpr double kReadoutModel = 0.3e-3;  // s
constexpr int kRun = 12;                  // points of one edge whose errors are alike

enum class Step : std::uint8_t {
  taken,
  still,  ///< taken, and so small that another would change nothing
  none,   ///< the equations have no solution
};

/// Edges that are now outliers and now not can carry full steps back and forth: steps that do not
/// get smaller are taken in part, and after a while noise and scatter are what they are.
struct Pace {
  int steps = 0;
  double part = 1;
  int small = 0;  ///< parts in a row that were the least
  double sigmas = std::numeric_limits<double>::infinity();

  bool learns() const { return steps < kLearningSteps; }
  void after(double length) {
    // A part of a step leaves the rest of it.
    part = length > (1 - 0.5 * part) * sigmas ? std::max(kLeastPart, 0.5 * part)
                                              : std::min(1.0, 1.5 * part);
    sigmas = length;
    // Small parts of the way may go round in circles as well.
    small = part == kLeastPart ? small + 1 : 0;
    if (small == kSmallParts) part = 1;
    ++steps;
  }
};

Step iterate(TargetObservations& seen, const std::vector<Keyframe>& frames, TargetState& state,
             bool free_focal, Pace& pace) {
  seen.observe(frames, state);
  if (pace.learns()) {
    seen.learn_noise();
    seen.learn_scatter(state);
  }
  TargetNormal normal = seen.equations(state, false);
  const Eigen::VectorXd shared =
      normal.reduce() ? normal.shared_step(free_focal) : Eigen::VectorXd();
  if (shared.size() == 0) return Step::none;
  // All or nothing: a step in part would pull apart what it moves together.
  const double zoom = shared[normal.focal_index()];
  const double part = std::min(pace.part, kMaxFocalStep / std::max(std::abs(zoom), 1e-12));
  const Eigen::VectorXd moved_frames = normal.frame_steps(shared);
  state.shift += part * normal.point_steps(shared, moved_frames);
  for (std::size_t k = 0; k < state.poses.size(); ++k) {
    state.poses[k] =
        moved(state.poses[k], part * moved_frames.segment<6>(6 * static_cast<Eigen::Index>(k)));
    renormalise(state.poses[k]);
  }
  for (std::size_t t = 0; t < state.camera_T_tag.size(); ++t) {
    const int tag = static_cast<int>(t);
    const Vector6 step = part * shared.segment<6>(6 * tag);
    state.camera_T_tag[t] = moved(state.camera_T_tag[t], step);
    renormalise(state.camera_T_tag[t]);
    state.print[t] += part * shared.segment<kPrintModes>(normal.print_index(tag));
  }
  state.readout += part * shared[normal.readout_index()];
  state.focal_ratio *= std::exp(part * zoom);
  const double sigmas = std::sqrt(shared.dot(normal.information() * shared));
  pace.after(sigmas);
  if (!std::isfinite(sigmas) || !std::isfinite(state.focal_ratio)) return Step::none;
  return sigmas < kStill ? Step::still : Step::taken;
}

/// How the residuals pull at keyframes and shared unknowns, summed over what is likely to err
/// alike: each column is one such cluster.
class Clusters {
 public:
  Clusters(const TargetObservations& seen, const TargetNormal& normal)
      : seen_(seen), normal_(normal) {}

  /// Runs of neighbouring points on one edge: what is wrong with these is wrong in every keyframe
  /// and hardly averages out.
  Eigen::MatrixXd of_points(const TargetState& state) const {
    const Eigen::VectorXd off = seen_.off_print(state);
    std::vector<Eigen::VectorXd> all;
    for (std::size_t t = 0; t < seen_.printed().size(); ++t) {
      const Eigen::Index print =
          normal_.keyframe_unknowns() + normal_.print_index(static_cast<int>(t));
      const std::vector<EdgePoint>& edge = seen_.printed()[t].points;
      Eigen::VectorXd pull = none();
      int run = 0;
      for (std::size_t i = 0; i < edge.size(); ++i) {
        const Eigen::Index p = seen_.first()[t] + static_cast<Eigen::Index>(i);
        double own = 0;
        seen_.for_each_offset(p, [&](const Observation& one, int frame, double weight) {
          own += add_offset(one, frame, t, weight, pull);
        });
        const double printed_off = seen_.print_weight(off[p]) * off[p];
        pull.segment<kPrintModes>(print) += printed_off * print_row(edge[i]);
        pull += normal_.point_pull(p, own - printed_off);
        if (++run < kRun && i + 1 < edge.size() && same_edge(edge[i], edge[i + 1])) continue;
        all.push_back(normal_.reduced_pull(pull));
        pull.setZero();
        run = 0;
      }
    }
    return columns(all);
  }

  /// One tag in one keyframe: paper that bends as it moves, a smear.
  Eigen::MatrixXd of_views() const {
    const std::size_t views = seen_.moving().size() + 1;  // and the rest image
    std::vector<Eigen::VectorXd> all(views * seen_.printed().size(), none());
    for (std::size_t t = 0; t < seen_.printed().size(); ++t) {
      for (Eigen::Index p = seen_.first()[t]; p < seen_.first()[t + 1]; ++p) {
        seen_.for_each_offset(p, [&](const Observation& offset, int frame, double weight) {
          Eigen::VectorXd& pull = all[views * t + static_cast<std::size_t>(frame + 1)];
          const double own = add_offset(offset, frame, t, weight, pull);
          pull += normal_.point_pull(p, own);
        });
      }
    }
    for (Eigen::VectorXd& pull : all) pull = normal_.reduced_pull(pull);
    return columns(all);
  }

 private:
  Eigen::VectorXd none() const {
    return Eigen::VectorXd::Zero(normal_.keyframe_unknowns() + normal_.shared_count());
  }

  /// Returns the pull on the point's own shift.
  double add_offset(const Observation& seen, int frame, std::size_t tag, double weight,
                    Eigen::VectorXd& pull) const {
    const Eigen::Index shared = normal_.keyframe_unknowns();
    const double w = weight * seen.offset;
    if (frame >= 0) pull.segment<6>(6 * frame) += w * seen.by.frame;
    pull.segment<6>(shared + 6 * static_cast<Eigen::Index>(tag)) += w * seen.by.tag;
    pull[shared + normal_.readout_index()] += w * seen.by.readout;
    pull[shared + normal_.focal_index()] += w * seen.by.focal;
    return w * seen.by.normal;
  }

  Eigen::MatrixXd columns(const std::vector<Eigen::VectorXd>& all) const {
    Eigen::MatrixXd out(normal_.shared_count(), all.size());
    for (std::size_t c = 0; c < all.size(); ++c) out.col(static_cast<Eigen::Index>(c)) = all[c];
    return out;
  }

  const TargetObservations& seen_;
  const TargetNormal& normal_;
};

/// The sandwich estimator for clustered errors (Liang and Zeger, Biometrika 73(1), 1986), never
/// less than `covariance`: each column of `pulls` is one cluster's, `fitted` parameters were taken
/// out of them.
Eigen::MatrixXd with_common_errors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& pulls,
                                   Eigen::Index fitted) {
  const auto clusters = static_cast<double>(pulls.cols());
  const double few = clusters / std::max(0.25 * clusters, clusters - static_cast<double>(fitted));
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  if (root.info() != Eigen::Success) return covariance;
  // In units in which the covariance is one.
  const Eigen::MatrixXd unit_pulls = root.matrixL().transpose() * pulls;
  const EigenSystem<Eigen::Dynamic> eigen =
      symmetric_eigen(Eigen::MatrixXd(few * unit_pulls * unit_pulls.transpose()));
  const Eigen::MatrixXd axes = root.matrixL() * eigen.vectors;
  return axes * eigen.values.cwiseMax(1.0).asDiagonal() * axes.transpose();
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& information) {
  return Ldlt<Eigen::Dynamic>(information).inverse();
}

/// `state` with the focal length as one of its unknowns.
void tell_focal(TargetObservations& seen, const std::vector<Keyframe>& frames,
                const TargetState& state, TargetEstimate& estimate) {
  seen.observe(frames, state);
  seen.learn_noise();
  // No camera is accused on the strength of how square a print is.
  TargetNormal normal = seen.equations(state, false, false);
  if (!normal.reduce()) return;
  const Eigen::Index focal = normal.focal_index();
  const auto tags = static_cast<Eigen::Index>(6 * state.camera_T_tag.size());
  const auto keyframes = static_cast<Eigen::Index>(frames.size());
  const Clusters clusters(seen, normal);
  const Eigen::MatrixXd covariance = covariance_of(normal.information());
  // Both ways of erring alike, what both count off once: Cameron, Gelbach and Miller, Journal of
  // Business & Economic Statistics 29(2), 2011. A keyframe's pose takes up one tag's view.
  const double variance =
      with_common_errors(covariance, clusters.of_points(state), tags + 1)(focal, focal) +
      with_common_errors(covariance, clusters.of_views(), keyframes)(focal, focal) -
      covariance(focal, focal);
  estimate.focal_ratio = state.focal_ratio;
  if (variance > 0) estimate.focal_sigma = std::hypot(kFocalModel, std::sqrt(variance));
}

struct Residual {
  double rms_px = 0;
  double count = 1;
};

Residual residual_of(const TargetObservations& seen) {
  double squares = 0, count = 0;
  for (const auto& frame : seen.moving()) {
    for (const Observation& offset : frame) {
      if (!offset.valid) continue;
      squares += offset.offset * offset.offset;
      count += 1;
    }
  }
  count = std::max(1.0, count);
  return {std::sqrt(squares / count), count};
}

}  // namespace

TargetEstimate adjust_target(const TargetAtRest& rest, const std::vector<Keyframe>& frames,
                             const std::function<bool(double)>& progress) {
  TargetObservations seen(rest);
  TargetState state;
  state.camera_T_tag = rest.camera_T_tag;
  state.print.assign(state.camera_T_tag.size(), PrintModes::Zero());
  state.shift = Eigen::VectorXd::Zero(seen.points());
  for (const Keyframe& frame : frames)
    state.poses.push_back(moved(seen.camera_T_platform_at_rest(), frame.displacement));

  int steps = 0;
  bool given_up = false;
  const auto settles = [&](TargetState& from, bool free_focal) {
    Pace pace;
    for (int i = 0; i < kMaxIterations; ++i) {
      const Step step = iterate(seen, frames, from, free_focal, pace);
      given_up = progress && !progress(std::min(1.0, ++steps / kUsualSteps));
      if (given_up || step == Step::none) return false;
      if (step == Step::still) return true;
    }
    return pace.sigmas < kNearlyStill;
  };
  TargetEstimate estimate;
  estimate.points = static_cast<int>(seen.points());
  if (!settles(state, false)) return estimate;

  // A focal length of the fit's own: where that leads nowhere the motion does not tell it.
  TargetState zoomed = state;
  if (settles(zoomed, true)) tell_focal(seen, frames, zoomed, estimate);
  if (given_up) return estimate;

  seen.observe(frames, state);
  seen.learn_noise();
  seen.learn_scatter(state);
  TargetNormal normal = seen.equations(state, false);
  TargetNormal alone = seen.equations(state, true);
  if (!normal.reduce() || !alone.reduce()) return estimate;
  const Eigen::Index all = normal.shared_count() - 1;  // without the focal length
  const auto tags = static_cast<Eigen::Index>(6 * state.camera_T_tag.size());
  const Eigen::MatrixXd covariance =
      with_common_errors(covariance_of(normal.information().topLeftCorner(all, all)),
                         Clusters(seen, normal).of_points(state).topRows(all), tags);
  estimate.covariance = covariance.topLeftCorner(tags, tags);
  estimate.covariance_at_rest =
      covariance_of(alone.information().topLeftCorner(all, all)).topLeftCorner(tags, tags);
  estimate.readout = state.readout;
  const Eigen::Index readout = normal.readout_index();
  const double readout_noise = std::sqrt(covariance(readout, readout));
  estimate.readout_sigma = std::hypot(kReadoutModel, readout_noise);
  estimate.camera_T_tag = state.camera_T_tag;
  estimate.print = state.print;
  estimate.print_scatter = seen.scatter().robust;
  estimate.noise_px = median({seen.noise_px().begin(), seen.noise_px().end()});
  const Residual residual = residual_of(seen);
  estimate.residual_px = residual.rms_px;
  // What one parameter takes off a sum of squared normalised residuals, in a linear fit.
  estimate.readout_gain = std::pow(estimate.readout / readout_noise, 2) / residual.count;
  estimate.solved = estimate.covariance.allFinite() && estimate.covariance_at_rest.allFinite();
  return estimate;
}

}  // namespace tagwrench
