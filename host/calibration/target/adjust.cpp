#include "host/calibration/target/adjust.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Half length of the profiles: short, for the paper's edge beyond the white margin comes near when
/// a tag leans away, and its blur would pull at the outer edges.
constexpr double kHalf_px = 3.5;
constexpr int kMaxIterations = 12;
constexpr double kStillPosition = 3e-8;  // m; a step of the tags below these is the end
constexpr double kStillRotation = 1e-5;  // rad
constexpr double kStillFocal = 1e-5;     // of the ratio
constexpr double kMaxFocalStep = 0.03;

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
constexpr double kReadoutModel = 0.3e-3;      // s
constexpr double kReadoutPrior = 30e-3;       // s, a rolling shutter's
constexpr double kSpreadPrior = 50e-6;        // m
constexpr double kMinContrastFraction = 0.3;  // of the tag's median, for a point to be used

CameraModel with_focal(CameraModel camera, double ratio) {
  camera.fx_px *= ratio;
  camera.fy_px *= ratio;
  return camera;
}

constexpr double kMinScatter = 0.5e-6;  // m
constexpr double kFirstScatter = 5e-6;  // m, before anything is known
constexpr double kCut = 4.0;            // sigmas, for an outlier
constexpr int kLags = 5;                // points along an edge over which errors may be alike

bool same_edge(const EdgePoint& a, const EdgePoint& b) {
  return a.normal == b.normal && (is_along_x(a.normal) ? a.x == b.x : a.y == b.y);
}

/// How far the edges of printed tags lie off the pattern.
struct PrintScatter {
  double robust = 0;     ///< standard deviation of one edge point about pattern and spread, m
  double effective = 0;  ///< what a point counts as: neighbours along an edge err alike, m
};

/// `shift` of every point of all tags in order (tag t has first[t] .. first[t+1]) and `spread` of
/// every tag, both toward white, m.
PrintScatter print_scatter(const std::vector<EdgeTag>& printed,
                           const std::vector<Eigen::Index>& first, const Eigen::VectorXd& shift,
                           const std::vector<double>& spread) {
  Eigen::VectorXd error = shift;
  for (std::size_t t = 0; t < printed.size(); ++t)
    error.segment(first[t], first[t + 1] - first[t]).array() -= spread[t];
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
    std::vector<double> spread;
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

  TargetNormal equations(const State& state, bool at_rest_only) const {
    const int frames = at_rest_only ? 0 : static_cast<int>(moving.size());
    TargetNormal normal(frames, static_cast<int>(printed.size()), points);
    normal.add_prior(normal.readout_index(), -state.readout, 1 / (kReadoutPrior * kReadoutPrior));
    for (std::size_t t = 0; t < printed.size(); ++t) {
      const int tag = static_cast<int>(t);
      normal.add_prior(normal.spread_index(tag), -state.spread[t],
                       1 / (kSpreadPrior * kSpreadPrior));
      for (Eigen::Index p = first[t]; p < first[t + 1]; ++p) {
        const double off_print = state.shift[p] - state.spread[t];
        const double print = biweight(off_print / (kTukey95 * scatter.robust)) /
                             (scatter.effective * scatter.effective);
        // A point off the print tells nothing of the scale, but still of the motion.
        normal.add_print(p, tag, -off_print, std::max(print, 1 / (kSpreadPrior * kSpreadPrior)));
        const double variance = noise_px[p] * noise_px[p];
        const auto add = [&](const Observation& seen, int frame, double weight) {
          if (seen.valid && weight > 0) normal.add({frame, tag, p, seen.by, seen.offset, weight});
        };
        add(at_rest[p], -1,
            1 / (variance / std::max(1, rest.image.frames) + kRestFloor_px * kRestFloor_px));
        for (int k = 0; k < frames; ++k) {
          const Observation& seen = moving[k][p];
          add(seen, k,
              biweight(seen.offset / (kTukey95 * noise_px[p])) /
                  (variance + frames * kModel_px * kModel_px));
        }
      }
    }
    return normal;
  }

  /// One step; true once it is so small that another would change nothing. Throws nothing; a step
  /// without a solution leaves NaN in the state.
  bool iterate(const std::vector<Keyframe>& frames, State& state, bool free_focal) {
    observe_all(frames, state);
    learn_noise();
    scatter = print_scatter(printed, first, state.shift, state.spread);
    TargetNormal normal = equations(state, false);
    const Eigen::VectorXd shared =
        normal.reduce() ? normal.shared_step(free_focal) : Eigen::VectorXd();
    if (shared.size() == 0) {
      state.focal_ratio = std::nan("");
      return true;
    }
    const Eigen::VectorXd moved_frames = normal.frame_steps(shared);
    state.shift += normal.point_steps(shared, moved_frames);
    for (std::size_t k = 0; k < state.poses.size(); ++k) {
      state.poses[k] =
          moved(state.poses[k], moved_frames.segment<6>(6 * static_cast<Eigen::Index>(k)));
      renormalise(state.poses[k]);
    }
    bool still = true;
    for (std::size_t t = 0; t < state.camera_T_tag.size(); ++t) {
      const Vector6 step = shared.segment<6>(6 * static_cast<Eigen::Index>(t));
      state.camera_T_tag[t] = moved(state.camera_T_tag[t], step);
      renormalise(state.camera_T_tag[t]);
      state.spread[t] += shared[normal.spread_index(static_cast<int>(t))];
      still =
          still && step.head<3>().norm() < kStillPosition && step.tail<3>().norm() < kStillRotation;
    }
    state.readout += shared[normal.readout_index()];
    const double zoom = std::clamp(shared[normal.focal_index()], -kMaxFocalStep, kMaxFocalStep);
    state.focal_ratio *= std::exp(zoom);
    return still && std::abs(zoom) < kStillFocal;
  }

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

using Places = Eigen::Matrix<Eigen::Index, 6, 1>;

constexpr double kLengthUnit = 5e-3;  // m
constexpr double kSpreadUnit = 1e-4;  // m
constexpr double kReadoutUnit = 0.1;  // s

Eigen::VectorXd unit_vector(Eigen::Index frames, Eigen::Index tags) {
  Eigen::VectorXd units = Eigen::VectorXd::Ones(6 * (frames + tags) + tags + 2);
  for (Eigen::Index i = 0; i < frames + tags; ++i) units.segment<3>(6 * i).setConstant(kLengthUnit);
  units.segment(6 * (frames + tags), tags).setConstant(kSpreadUnit);
  units[6 * (frames + tags) + tags] = kReadoutUnit;
  return units;
}

}  // namespace

TargetEstimate adjust_target(const TargetAtRest& rest, const std::vector<Keyframe>& frames,
                             const std::function<bool(double)>& progress) {
  Problem problem(rest);
  Problem::State state;
  state.camera_T_tag = rest.camera_T_tag;
  state.spread.assign(state.camera_T_tag.size(), 0.0);
  state.shift = Eigen::VectorXd::Zero(problem.points);
  for (const Keyframe& frame : frames)
    state.poses.push_back(moved(problem.rest_pose, frame.displacement));

  int steps = 0;
  const auto settle = [&](Problem::State& from, bool free_focal) {
    for (int i = 0; i < kMaxIterations; ++i) {
      const bool still = problem.iterate(frames, from, free_focal);
      if (progress && !progress(++steps / (2.0 * kMaxIterations))) return false;
      if (still) break;
    }
    return std::isfinite(from.focal_ratio);
  };
  TargetEstimate estimate;
  estimate.points = static_cast<int>(problem.points);
  if (!settle(state, false)) return estimate;
  Problem::State zoomed = state;
  if (!settle(zoomed, true)) return estimate;
  estimate.focal_ratio = zoomed.focal_ratio;

  problem.observe_all(frames, state);
  problem.learn_noise();
  TargetNormal normal = problem.equations(state, false);
  TargetNormal alone = problem.equations(state, true);
  if (!normal.reduce() || !alone.reduce()) return estimate;
  const Eigen::Index all = normal.shared_count() - 1;  // without the focal length
  const auto tags = static_cast<Eigen::Index>(6 * state.camera_T_tag.size());
  const auto inverse = [](const Eigen::MatrixXd& information) -> Eigen::MatrixXd {
    return Ldlt<Eigen::Dynamic>(information).inverse();
  };
  const Eigen::MatrixXd covariance = inverse(normal.information().topLeftCorner(all, all));
  estimate.covariance = covariance.topLeftCorner(tags, tags);
  estimate.covariance_at_rest =
      inverse(alone.information().topLeftCorner(all, all)).topLeftCorner(tags, tags);
  estimate.focal_sigma =
      std::hypot(kFocalModel, std::sqrt(inverse(normal.information())(all, all)));
  estimate.readout = state.readout;
  const Eigen::Index readout = normal.readout_index();
  const double readout_noise = std::sqrt(covariance(readout, readout));
  estimate.readout_sigma = std::hypot(kReadoutModel, readout_noise);
  estimate.camera_T_tag = state.camera_T_tag;
  estimate.ink_spread = state.spread;
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
  estimate.solved = estimate.covariance.allFinite() && estimate.covariance_at_rest.allFinite() &&
                    std::isfinite(estimate.focal_sigma);
  return estimate;
}

EdgeDerivatives edge_derivatives(const CameraModel& camera, const EdgeMeasurement& measurement,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const Eigen::Isometry3d& rest_camera_T_platform,
                                 const Eigen::Isometry3d& camera_T_tag,
                                 const Eigen::Vector3d& point) {
  EdgeDerivatives by;
  by.frame = measurement.row;
  by.normal = measurement.px_per_m;
  // A motion (t, r) of the tag at rest moves the point by t + r x arm at rest, and by that turned
  // in the picture.
  const Eigen::Matrix3d turn =
      camera_T_platform.linear() * rest_camera_T_platform.linear().transpose();
  const Eigen::Vector3d pull = turn.transpose() * measurement.row.head<3>();
  const Eigen::Vector3d arm = camera_T_tag.linear() * point;
  by.tag << pull, arm.cross(pull);
  // measurement.row begins with J^T n, n the direction of the profile and J the projection's
  // derivative; the image grows about the principal point.
  const Eigen::Vector3d p =
      camera_T_platform * (rest_camera_T_platform.inverse() * (camera_T_tag * point));
  const ProjectedPoint seen = project(camera, p);
  const Eigen::Matrix2d square = seen.jacobian * seen.jacobian.transpose();
  const Eigen::Vector2d direction = square.inverse() * (seen.jacobian * measurement.row.head<3>());
  by.focal = direction.dot(seen.pixel - Eigen::Vector2d(camera.cx_px, camera.cy_px));
  by.row_px = seen.pixel.y();
  return by;
}

TargetNormal::TargetNormal(int frames, int tags, Eigen::Index points)
    : tags_(tags), moving_(6 * frames), shared_(7 * tags + 2), units_(unit_vector(frames, tags)) {
  const Eigen::Index all = moving_ + shared_;
  normal_ = Eigen::MatrixXd::Zero(all, all);
  right_ = Eigen::VectorXd::Zero(all);
  coupling_ = Eigen::MatrixXd::Zero(all, points);
  pivot_ = Eigen::VectorXd::Zero(points);
  pull_ = Eigen::VectorXd::Zero(points);
}

void TargetNormal::add(const EdgeEquation& equation) {
  const double w = equation.weight;
  const Eigen::Index tag = moving_ + 6 * equation.tag;
  const Eigen::Index camera = moving_ + readout_index();
  const bool moves = equation.frame >= 0;
  const Eigen::Index frame = moves ? 6 * equation.frame : 0;
  Eigen::Matrix<Eigen::Index, 14, 1> at;
  at << Places::LinSpaced(frame, frame + 5), Places::LinSpaced(tag, tag + 5), camera, camera + 1;
  Eigen::Matrix<double, 14, 1> by;
  by << (moves ? 1 : 0) * equation.by.frame, equation.by.tag, equation.by.readout,
      equation.by.focal;
  by.array() *= units_(at).array();
  normal_(at, at) += w * by * by.transpose();
  right_(at) += w * equation.offset * by;
  const double v = w * equation.by.normal;
  coupling_.col(equation.point)(at) += v * by;
  pivot_[equation.point] += v * equation.by.normal;
  pull_[equation.point] += v * equation.offset;
}

void TargetNormal::add_print(Eigen::Index point, int tag, double offset, double weight) {
  const Eigen::Index spread = moving_ + spread_index(tag);
  add_prior(spread_index(tag), -offset, weight);
  coupling_(spread, point) -= weight * units_[spread];
  pivot_[point] += weight;
  pull_[point] += weight * offset;
}

void TargetNormal::add_prior(Eigen::Index shared, double offset, double weight) {
  const Eigen::Index at = moving_ + shared;
  normal_(at, at) += weight * units_[at] * units_[at];
  right_[at] += weight * offset * units_[at];
}

bool TargetNormal::reduce() {
  if (!(pivot_.array() > 0).all()) return false;
  const Eigen::VectorXd root = pivot_.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = coupling_ * root.asDiagonal();
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(scaled, -1.0);
  right_ -= scaled * pull_.cwiseProduct(root);

  const Eigen::MatrixXd cross = normal_.bottomLeftCorner(shared_, moving_);
  reduced_ = normal_.bottomRightCorner(shared_, shared_).selfadjointView<Eigen::Lower>();
  reduced_right_ = right_.tail(shared_);
  if (moving_ == 0) return true;
  auto block = normal_.topLeftCorner(moving_, moving_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(block);  // in place
  if (factor.info() != Eigen::Success) return false;
  const auto lower = block.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd half = lower.solve(cross.transpose());
  reduced_ -= half.transpose() * half;
  reduced_right_ -= half.transpose() * lower.solve(right_.head(moving_));
  return reduced_.allFinite();
}

Eigen::MatrixXd TargetNormal::information() const {
  const auto units = units_.tail(shared_).cwiseInverse();
  return units.asDiagonal() * reduced_ * units.asDiagonal();
}

Eigen::VectorXd TargetNormal::shared_step(bool free_focal) const {
  const Eigen::Index count = free_focal ? shared_ : shared_ - 1;
  const Ldlt<Eigen::Dynamic> factor(reduced_.topLeftCorner(count, count));
  if (!factor.positive(1e-14)) return {};
  Eigen::VectorXd step = Eigen::VectorXd::Zero(shared_);
  step.head(count) = factor.solve(reduced_right_.head(count));
  step.array() *= units_.tail(shared_).array();
  return step.allFinite() ? step : Eigen::VectorXd();
}

Eigen::VectorXd TargetNormal::frame_steps(const Eigen::VectorXd& shared) const {
  if (moving_ == 0) return {};
  const Eigen::VectorXd scaled = shared.cwiseQuotient(units_.tail(shared_));
  const auto lower = normal_.topLeftCorner(moving_, moving_).triangularView<Eigen::Lower>();
  Eigen::VectorXd steps =
      right_.head(moving_) - normal_.bottomLeftCorner(shared_, moving_).transpose() * scaled;
  lower.solveInPlace(steps);
  lower.transpose().solveInPlace(steps);
  return steps.cwiseProduct(units_.head(moving_));
}

Eigen::VectorXd TargetNormal::point_steps(const Eigen::VectorXd& shared,
                                          const Eigen::VectorXd& frames) const {
  Eigen::VectorXd all(moving_ + shared_);
  all << frames, shared;
  all.array() /= units_.array();
  return (pull_ - coupling_.transpose() * all).cwiseQuotient(pivot_);
}

}  // namespace tagwrench
