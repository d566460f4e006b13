#include "host/calibration/target/adjust.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "host/calibration/target/equations.h"
#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Half length of the profiles: short, for the paper's edge beyond the white margin comes near when
/// a tag leans away, and its blur would pull at the outer edges.
constexpr double kHalf_px = 3.5;
constexpr int kMaxIterations = 40;
constexpr double kUsualSteps = 16;  // both fits together, for the progress that is told
constexpr double kStill = 0.2;      // sigmas of the shared unknowns together, to be the end
constexpr double kNearlyStill = 1;  // where it will not get better
constexpr int kLearningSteps = 10;
constexpr double kLeastPart = 0.125;
constexpr int kSmallParts = 4;
constexpr double kMaxFocalStep = 0.03;  // a longer step is shortened, with all that goes with it

constexpr double kMinNoise_px = 0.01;
constexpr double kMinNoiseFraction = 0.5;  // of a point, to the median of all
constexpr int kFewSeen = 8;                // frames that show too little of a point's noise
constexpr double kRestFloor_px = 0.01;     // the averaged rest image has errors that do not average
/// What keeps the offsets of all frames together from being better than this, however many there
/// are: shading, change of blur.
constexpr double kModel_px = 0.004;
/// And the same for the focal length, as a part of it.
constexpr double kFocalModel = 0.002;
/// And the read-out time: a picture's velocity is the mean over two steps.
constexpr double kReadoutModel = 0.3e-3;  // s
constexpr double kReadoutPrior = 30e-3;   // s, a rolling shutter's
constexpr double kSpreadPrior = 50e-6;    // m
constexpr double kOpen = 0.02;            // aspect and shear of which nothing is known
constexpr double kSizeApart = 0.01;       // of one tag from that of all
/// Size and distance look alike: the tags together are as large as said, for the fit.
constexpr double kTotalSize = 1e-5;
constexpr double kMinContrastFraction = 0.3;  // of the tag's median, for a point to be used

CameraModel with_focal(CameraModel camera, double ratio) {
  camera.fx_px *= ratio;
  camera.fy_px *= ratio;
  return camera;
}

constexpr double kMinScatter = 1e-6;    // m
constexpr double kFirstScatter = 5e-6;  // m, before anything is known
constexpr double kCut = 4.0;            // sigmas, for an outlier
constexpr int kRun = 12;                // points of one edge whose errors are alike
constexpr int kLags = 5;                // points along an edge over which errors may be alike

bool same_edge(const EdgePoint& a, const EdgePoint& b) {
  return a.normal == b.normal && (is_along_x(a.normal) ? a.x == b.x : a.y == b.y);
}

/// How far the edges of printed tags lie off the pattern.
struct PrintScatter {
  double robust = 0;     ///< standard deviation of one edge point about pattern and spread, m
  double effective = 0;  ///< what a point counts as: neighbours along an edge err alike, m
};

/// `error`, m, of every point of all tags in order: tag t has first[t] .. first[t+1].
PrintScatter print_scatter(const std::vector<EdgeTag>& printed,
                           const std::vector<Eigen::Index>& first, Eigen::VectorXd error) {
  if (error.size() == 0 || error.isZero()) return {kFirstScatter, kFirstScatter};
  const Eigen::VectorXd sizes = error.cwiseAbs();
  PrintScatter out;
  out.robust = std::max(kMinScatter, kMadToSigma * median({sizes.begin(), sizes.end()}));
  error = error.cwiseMax(-kCut * out.robust).cwiseMin(kCut * out.robust);

  // The mean of n errors with autocorrelation r_l has the variance of n / (1 + 2 sum r_l)
  // independent ones.
  std::array<double, kLags + 1> sums{}, counts{};
  for (std::size_t t = 0; t < printed.size(); ++t) {
    const std::vector<EdgePoint>& points = printed[t].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t lag = 0; lag <= kLags && i + lag < points.size(); ++lag) {
        if (!same_edge(points[i], points[i + lag])) break;
        const Eigen::Index at = first[t] + static_cast<Eigen::Index>(i);
        sums[lag] += error[at] * error[at + static_cast<Eigen::Index>(lag)];
        counts[lag] += 1;
      }
    }
  }
  double alike = 1;
  for (std::size_t lag = 1; lag <= kLags; ++lag)
    if (counts[lag] > 0)
      alike += 2 * std::max(0.0, sums[lag] / counts[lag]) / (sums[0] / counts[0]);
  out.effective = out.robust * std::sqrt(alike);
  return out;
}

struct Observation {
  bool valid = false;
  double offset = 0;  // px, true to scale
  EdgeDerivatives by;
};

struct Problem {
  // What moves while iterating.
  struct State {
    std::vector<Eigen::Isometry3d> camera_T_tag;
    std::vector<PrintModes> print;
    Eigen::VectorXd shift;  // of each point, toward white, m
    std::vector<Eigen::Isometry3d> poses;
    double readout = 0;  // s
    double focal_ratio = 1;
  };

  explicit Problem(const TargetAtRest& given)
      : rest(given), rest_pose(midpoint_frame(given.camera_T_tag)) {
    for (const TagPattern& pattern : rest.patterns)
      printed.push_back(make_edge_tag(pattern, Eigen::Isometry3d::Identity()));
    keep_visible();
  }

  PixelView<float> rest_view() const {
    return {rest.image.level.data(), rest.image.width, rest.image.height, rest.image.width};
  }

  /// Leaves out the points that have no clear edge in the rest image.
  void keep_visible() {
    const EdgeMeter meter(rest.camera);
    first.assign(1, 0);
    for (std::size_t t = 0; t < printed.size(); ++t) {
      EdgeTag& tag = printed[t];
      tag.platform_T_tag = rest_pose.inverse() * rest.camera_T_tag[t];
      std::vector<EdgeMeasurement> seen(tag.points.size());
      meter.measure(rest_view(), tag, rest_pose, kHalf_px, false, seen);
      const double least = kMinContrastFraction * median_contrast(seen);
      std::vector<EdgePoint> kept;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (!seen[i].valid || seen[i].contrast < least) continue;
        kept.push_back(tag.points[i]);
        kept.back().contrast = static_cast<float>(seen[i].contrast);
      }
      tag.points = std::move(kept);
      first.push_back(first.back() + static_cast<Eigen::Index>(tag.points.size()));
    }
    points = first.back();
  }

  EdgeTag edges(const State& state, std::size_t tag) const {
    EdgeTag out = printed[tag];
    out.platform_T_tag = rest_pose.inverse() * state.camera_T_tag[tag];
    for (std::size_t i = 0; i < out.points.size(); ++i)
      out.points[i] =
          shifted(out.points[i], state.shift[first[tag] + static_cast<Eigen::Index>(i)]);
    return out;
  }

  /// How far each point lies off the pattern as a whole was printed, m.
  Eigen::VectorXd off_print(const State& state) const {
    Eigen::VectorXd off = state.shift;
    for (std::size_t t = 0; t < printed.size(); ++t) {
      for (std::size_t i = 0; i < printed[t].points.size(); ++i)
        off[first[t] + static_cast<Eigen::Index>(i)] -=
            print_row(printed[t].points[i]).dot(state.print[t]);
    }
    return off;
  }

  /// How far (m, along its normal) the rolling shutter shows each point off its place.
  Eigen::VectorXd lateness(const std::vector<Observation>& seen, double readout) const {
    Eigen::VectorXd late = Eigen::VectorXd::Zero(points);
    for (std::size_t p = 0; p < seen.size(); ++p)
      if (seen[p].valid) late[p] = seen[p].by.readout * readout / seen[p].by.normal;
    return late;
  }

  /// Profiles are taken `late` off the points' places, and offsets count from there.
  template <class Pixel>
  void observe(const EdgeMeter& meter, const PixelView<Pixel>& image, const State& state,
               const Eigen::Isometry3d& pose, const Eigen::VectorXd& late,
               std::vector<Observation>& out) const {
    out.assign(static_cast<std::size_t>(points), {});
    for (std::size_t t = 0; t < printed.size(); ++t) {
      EdgeTag tag = edges(state, t);
      for (std::size_t i = 0; i < tag.points.size(); ++i)
        tag.points[i] = shifted(tag.points[i], late[first[t] + static_cast<Eigen::Index>(i)]);
      std::vector<EdgeMeasurement> measured(tag.points.size());
      meter.measure(image, tag, pose, kHalf_px, false, measured);
      const double gain = median_gain(measured);
      for (std::size_t i = 0; i < measured.size(); ++i) {
        if (!measured[i].valid) continue;
        Observation& seen = out[static_cast<std::size_t>(first[t]) + i];
        seen.valid = true;
        seen.by = edge_derivatives(meter.camera(), measured[i], pose, rest_pose,
                                   state.camera_T_tag[t], {tag.points[i].x, tag.points[i].y, 0});
        seen.offset = measured[i].offset_px / gain;
      }
    }
  }

  void observe_all(const std::vector<Keyframe>& frames, const State& state) {
    observe(EdgeMeter(with_focal(rest.camera, state.focal_ratio)), rest_view(), state, rest_pose,
            Eigen::VectorXd::Zero(points), at_rest);
    moving.resize(frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const Keyframe& frame = frames[k];
      // Profiles are short: an edge that is far from where it is looked for is found too near.
      const Eigen::VectorXd late = lateness(moving[k], state.readout);
      observe(EdgeMeter(with_focal(frame.camera, state.focal_ratio)), frame.view(), state,
              state.poses[k], late, moving[k]);
      // A row is read before or after the middle one, by its part of the read-out time.
      const double middle = 0.5 * (frame.image_rows - 1) - frame.first_row;
      for (std::size_t p = 0; p < moving[k].size(); ++p) {
        Observation& seen = moving[k][p];
        seen.by.readout =
            seen.by.frame.dot(frame.velocity) * (seen.by.row_px - middle) / frame.image_rows;
        seen.offset += late[p] * seen.by.normal - seen.by.readout * state.readout;
      }
    }
  }

  /// Of each point, from its own offsets in all keyframes: points differ in contrast and in the
  /// length of their profiles.
  void learn_noise() {
    noise_px = Eigen::VectorXd::Zero(points);
    std::vector<double> all;
    for (Eigen::Index p = 0; p < points; ++p) {
      std::vector<double> offsets;
      for (const auto& frame : moving) {
        const Observation& seen = frame[p];
        if (seen.valid) offsets.push_back(std::abs(seen.offset));
      }
      if (offsets.size() < kFewSeen) continue;
      noise_px[p] = kMadToSigma * median(offsets);
      all.push_back(noise_px[p]);
    }
    const double typical = std::max(kMinNoise_px, median(all));
    for (double& noise : noise_px)
      noise = noise > 0 ? std::max(noise, kMinNoiseFraction * typical) : typical;
  }

  /// `use` is told an observation of the point, its keyframe or -1, and its weight, 1/px^2.
  template <class Use>
  void for_each_offset(Eigen::Index p, const Use& use) const {
    const auto frames = static_cast<int>(moving.size());
    const double variance = noise_px[p] * noise_px[p];
    const Observation& still = at_rest[static_cast<std::size_t>(p)];
    if (still.valid) {
      use(still, -1,
          1 / (variance / std::max(1, rest.image.frames) + kRestFloor_px * kRestFloor_px));
    }
    for (int k = 0; k < frames; ++k) {
      const Observation& seen = moving[static_cast<std::size_t>(k)][static_cast<std::size_t>(p)];
      const double weight = seen.valid ? biweight(seen.offset / (kTukey95 * noise_px[p])) /
                                             (variance + frames * kModel_px * kModel_px)
                                       : 0;
      if (weight > 0) use(seen, k, weight);
    }
  }

  /// 1/m^2. A point off the print tells nothing of the scale, but still of the motion.
  double print_weight(double off) const {
    const double print = std::min(1.0, kHuber95 * scatter.robust / std::abs(off)) /
                         (scatter.effective * scatter.effective);
    return std::max(print, 1 / (kSpreadPrior * kSpreadPrior));
  }

  /// Of the print's modes, in SI. Sizes are told apart by the motion. Aspect and shear are
  /// usually small and sometimes large: Cauchy's distribution, so that a print which the motion
  /// shows to be off is not held back.
  PrintModes print_weights(const PrintModes& print, bool square) const {
    PrintModes sigma = print_prior();
    sigma[kSizeMode] = kSizeApart;
    PrintModes variance = sigma.cwiseAbs2();
    for (int mode = kSizeMode + 1; mode < kPrintModes; ++mode)
      variance[mode] = square ? variance[mode] + print[mode] * print[mode] : kOpen * kOpen;
    return variance.cwiseInverse();
  }

  /// `square`: prints are taken for square, as far as nothing speaks against it.
  TargetNormal equations(const State& state, bool at_rest_only, bool square = true) const {
    const int frames = at_rest_only ? 0 : static_cast<int>(moving.size());
    TargetNormal normal(frames, static_cast<int>(printed.size()), points);
    normal.add_prior(normal.readout_index(), -state.readout, 1 / (kReadoutPrior * kReadoutPrior));
    double size = 0;
    for (const PrintModes& print : state.print) size += print[kSizeMode];
    normal.add_total_size(-size, 1 / (kTotalSize * kTotalSize));
    const Eigen::VectorXd off = off_print(state);
    for (std::size_t t = 0; t < printed.size(); ++t) {
      const int tag = static_cast<int>(t);
      const PrintModes weights = print_weights(state.print[t], square);
      for (int mode = 0; mode < kPrintModes; ++mode)
        normal.add_prior(normal.print_index(tag) + mode, -state.print[t][mode], weights[mode]);
      for (Eigen::Index p = first[t]; p < first[t + 1]; ++p) {
        normal.add_print(p, tag,
                         print_row(printed[t].points[static_cast<std::size_t>(p - first[t])]),
                         -off[p], print_weight(off[p]));
        for_each_offset(p, [&](const Observation& seen, int frame, double weight) {
          if (frame < frames) normal.add({frame, tag, p, seen.by, seen.offset, weight});
        });
      }
    }
    return normal;
  }

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

  Step iterate(const std::vector<Keyframe>& frames, State& state, bool free_focal, Pace& pace) {
    observe_all(frames, state);
    if (pace.learns()) {
      learn_noise();
      scatter = print_scatter(printed, first, off_print(state));
    }
    TargetNormal normal = equations(state, false);
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
    Clusters(const Problem& problem, const TargetNormal& normal)
        : problem_(problem), normal_(normal) {}

    /// Runs of neighbouring points on one edge: what is wrong with these is wrong in every keyframe
    /// and hardly averages out.
    Eigen::MatrixXd of_points(const State& state) const {
      const Eigen::VectorXd off = problem_.off_print(state);
      std::vector<Eigen::VectorXd> all;
      for (std::size_t t = 0; t < problem_.printed.size(); ++t) {
        const Eigen::Index print =
            normal_.keyframe_unknowns() + normal_.print_index(static_cast<int>(t));
        const std::vector<EdgePoint>& edge = problem_.printed[t].points;
        Eigen::VectorXd pull = none();
        int run = 0;
        for (std::size_t i = 0; i < edge.size(); ++i) {
          const Eigen::Index p = problem_.first[t] + static_cast<Eigen::Index>(i);
          double own = 0;
          problem_.for_each_offset(p, [&](const Observation& seen, int frame, double weight) {
            own += add_offset(seen, frame, t, weight, pull);
          });
          const double printed_off = problem_.print_weight(off[p]) * off[p];
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
      const std::size_t views = problem_.moving.size() + 1;  // and the rest image
      std::vector<Eigen::VectorXd> all(views * problem_.printed.size(), none());
      for (std::size_t t = 0; t < problem_.printed.size(); ++t) {
        for (Eigen::Index p = problem_.first[t]; p < problem_.first[t + 1]; ++p) {
          problem_.for_each_offset(p, [&](const Observation& seen, int frame, double weight) {
            Eigen::VectorXd& pull = all[views * t + static_cast<std::size_t>(frame + 1)];
            const double own = add_offset(seen, frame, t, weight, pull);
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

    const Problem& problem_;
    const TargetNormal& normal_;
  };

  const TargetAtRest& rest;
  Eigen::Isometry3d rest_pose;
  std::vector<EdgeTag> printed;
  std::vector<Eigen::Index> first;  // point of each tag, and the end
  Eigen::Index points = 0;

  std::vector<Observation> at_rest;              // of each point
  std::vector<std::vector<Observation>> moving;  // of each keyframe and point
  Eigen::VectorXd noise_px;                      // of each point in one keyframe
  PrintScatter scatter;
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

}  // namespace

TargetEstimate adjust_target(const TargetAtRest& rest, const std::vector<Keyframe>& frames,
                             const std::function<bool(double)>& progress) {
  Problem problem(rest);
  Problem::State state;
  state.camera_T_tag = rest.camera_T_tag;
  state.print.assign(state.camera_T_tag.size(), PrintModes::Zero());
  state.shift = Eigen::VectorXd::Zero(problem.points);
  for (const Keyframe& frame : frames)
    state.poses.push_back(moved(problem.rest_pose, frame.displacement));

  int steps = 0;
  bool given_up = false;
  const auto settles = [&](Problem::State& from, bool free_focal) {
    Problem::Pace pace;
    for (int i = 0; i < kMaxIterations; ++i) {
      const Problem::Step step = problem.iterate(frames, from, free_focal, pace);
      given_up = progress && !progress(std::min(1.0, ++steps / kUsualSteps));
      if (given_up || step == Problem::Step::none) return false;
      if (step == Problem::Step::still) return true;
    }
    return pace.sigmas < kNearlyStill;
  };
  TargetEstimate estimate;
  estimate.points = static_cast<int>(problem.points);
  if (!settles(state, false)) return estimate;

  const auto inverse = [](const Eigen::MatrixXd& information) -> Eigen::MatrixXd {
    return Ldlt<Eigen::Dynamic>(information).inverse();
  };
  // A focal length of the fit's own: where that leads nowhere the motion does not tell it.
  Problem::State zoomed = state;
  if (settles(zoomed, true)) {
    problem.observe_all(frames, zoomed);
    problem.learn_noise();
    // No camera is accused on the strength of how square a print is.
    TargetNormal normal = problem.equations(zoomed, false, false);
    if (normal.reduce()) {
      const Eigen::Index focal = normal.focal_index();
      const auto tags = static_cast<Eigen::Index>(6 * zoomed.camera_T_tag.size());
      const Problem::Clusters clusters(problem, normal);
      const Eigen::MatrixXd covariance = inverse(normal.information());
      // Both ways of erring alike, what both count off once: Cameron, Gelbach and Miller, Journal
      // of Business & Economic Statistics 29(2), 2011. A keyframe's pose takes up one tag's view.
      const double variance =
          with_common_errors(covariance, clusters.of_points(zoomed), tags + 1)(focal, focal) +
          with_common_errors(covariance, clusters.of_views(),
                             static_cast<Eigen::Index>(frames.size()))(focal, focal) -
          covariance(focal, focal);
      estimate.focal_ratio = zoomed.focal_ratio;
      if (variance > 0) estimate.focal_sigma = std::hypot(kFocalModel, std::sqrt(variance));
    }
  }
  if (given_up) return estimate;

  problem.observe_all(frames, state);
  problem.learn_noise();
  problem.scatter = print_scatter(problem.printed, problem.first, problem.off_print(state));
  TargetNormal normal = problem.equations(state, false);
  TargetNormal alone = problem.equations(state, true);
  if (!normal.reduce() || !alone.reduce()) return estimate;
  const Eigen::Index all = normal.shared_count() - 1;  // without the focal length
  const auto tags = static_cast<Eigen::Index>(6 * state.camera_T_tag.size());
  const Eigen::MatrixXd covariance =
      with_common_errors(inverse(normal.information().topLeftCorner(all, all)),
                         Problem::Clusters(problem, normal).of_points(state).topRows(all), tags);
  estimate.covariance = covariance.topLeftCorner(tags, tags);
  estimate.covariance_at_rest =
      inverse(alone.information().topLeftCorner(all, all)).topLeftCorner(tags, tags);
  estimate.readout = state.readout;
  const Eigen::Index readout = normal.readout_index();
  const double readout_noise = std::sqrt(covariance(readout, readout));
  estimate.readout_sigma = std::hypot(kReadoutModel, readout_noise);
  estimate.camera_T_tag = state.camera_T_tag;
  estimate.print = state.print;
  estimate.print_scatter = problem.scatter.robust;
  estimate.noise_px = median({problem.noise_px.begin(), problem.noise_px.end()});
  double squares = 0, count = 0;
  for (const auto& frame : problem.moving) {
    for (const Observation& seen : frame) {
      if (!seen.valid) continue;
      squares += seen.offset * seen.offset;
      count += 1;
    }
  }
  estimate.residual_px = std::sqrt(squares / std::max(1.0, count));
  // What one parameter takes off a sum of squared normalised residuals, in a linear fit.
  estimate.readout_gain = std::pow(estimate.readout / readout_noise, 2) / std::max(1.0, count);
  estimate.solved = estimate.covariance.allFinite() && estimate.covariance_at_rest.allFinite();
  return estimate;
}

}  // namespace tagwrench
