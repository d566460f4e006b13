#include "host/calibration/target/observations.h"

#include <array>
#include <cmath>
#include <utility>

#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Half length of the profiles: short, for the paper's edge beyond the white margin comes near when
/// a tag leans away, and its blur would pull at the outer edges.
constexpr double kHalf_px = 3.5;
constexpr double kMinNoise_px = 0.01;
constexpr double kMinNoiseFraction = 0.5;  // of a point, to the median of all
constexpr int kFewSeen = 8;                // frames that show too little of a point's noise
constexpr double kRestFloor_px = 0.01;     // the averaged rest image has errors that do not average
/// What keeps the offsets of all frames together from being better than this, however many there
/// are: shading, change of blur.
constexpr double kModel_px = 0.004;
constexpr double kReadoutPrior = 30e-3;  // s, a rolling shutter's
constexpr double kSpreadPrior = 50e-6;   // m
constexpr double kOpen = 0.02;           // aspect and shear of which nothing is known
constexpr double kSizeApart = 0.01;      // of one tag from that of all
/// Size and distance look alike: the tags together are as large as said, for the fit.
constexpr double kTotalSize = 1e-5;
constexpr double kMinContrastFraction = 0.3;  // of the tag's median, for a point to be used
constexpr double kMinScatter = 1e-6;          // m
constexpr double kFirstScatter = 5e-6;        // m, before anything is known
constexpr double kCut = 4.0;                  // sigmas, for an outlier
constexpr int kLags = 5;                      // points along an edge over which errors may be alike

CameraModel with_focal(CameraModel camera, double ratio) {
  camera.fx_px *= ratio;
  camera.fy_px *= ratio;
  return camera;
}

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

/// Of the print's modes, in SI. Sizes are told apart by the motion. Aspect and shear are usually
/// small and sometimes large: Cauchy's distribution, so that a print which the motion shows to be
/// off is not held back.
PrintModes print_weights(const PrintModes& print, bool square) {
  PrintModes sigma = print_prior();
  sigma[kSizeMode] = kSizeApart;
  PrintModes variance = sigma.cwiseAbs2();
  for (int mode = kSizeMode + 1; mode < kPrintModes; ++mode)
    variance[mode] = square ? variance[mode] + print[mode] * print[mode] : kOpen * kOpen;
  return variance.cwiseInverse();
}

}  // namespace

bool same_edge(const EdgePoint& a, const EdgePoint& b) {
  return a.normal == b.normal && (is_along_x(a.normal) ? a.x == b.x : a.y == b.y);
}

TargetObservations::TargetObservations(const TargetAtRest& rest)
    : rest_(rest), rest_pose_(midpoint_frame(rest.camera_T_tag)) {
  for (const TagPattern& pattern : rest_.patterns)
    printed_.push_back(make_edge_tag(pattern, Eigen::Isometry3d::Identity()));
  keep_visible();
}

PixelView<float> TargetObservations::rest_view() const {
  return {rest_.image.level.data(), rest_.image.width, rest_.image.height, rest_.image.width};
}

void TargetObservations::keep_visible() {
  const EdgeMeter meter(rest_.camera);
  first_.assign(1, 0);
  for (std::size_t t = 0; t < printed_.size(); ++t) {
    EdgeTag& tag = printed_[t];
    tag.platform_T_tag = rest_pose_.inverse() * rest_.camera_T_tag[t];
    std::vector<EdgeMeasurement> seen(tag.points.size());
    meter.measure(rest_view(), tag, rest_pose_, kHalf_px, false, seen);
    const double least = kMinContrastFraction * median_contrast(seen);
    std::vector<EdgePoint> kept;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!seen[i].valid || seen[i].contrast < least) continue;
      kept.push_back(tag.points[i]);
      kept.back().contrast = static_cast<float>(seen[i].contrast);
    }
    tag.points = std::move(kept);
    first_.push_back(first_.back() + static_cast<Eigen::Index>(tag.points.size()));
  }
}

EdgeTag TargetObservations::edges(const TargetState& state, std::size_t tag) const {
  EdgeTag out = printed_[tag];
  out.platform_T_tag = rest_pose_.inverse() * state.camera_T_tag[tag];
  for (std::size_t i = 0; i < out.points.size(); ++i)
    out.points[i] = shifted(out.points[i], state.shift[first_[tag] + static_cast<Eigen::Index>(i)]);
  return out;
}

Eigen::VectorXd TargetObservations::off_print(const TargetState& state) const {
  Eigen::VectorXd off = state.shift;
  for (std::size_t t = 0; t < printed_.size(); ++t) {
    for (std::size_t i = 0; i < printed_[t].points.size(); ++i)
      off[first_[t] + static_cast<Eigen::Index>(i)] -=
          print_row(printed_[t].points[i]).dot(state.print[t]);
  }
  return off;
}

/// How far (m, along its normal) the rolling shutter shows each point off its place.
Eigen::VectorXd TargetObservations::lateness(const std::vector<Observation>& seen,
                                             double readout) const {
  Eigen::VectorXd late = Eigen::VectorXd::Zero(points());
  for (std::size_t p = 0; p < seen.size(); ++p)
    if (seen[p].valid) late[p] = seen[p].by.readout * readout / seen[p].by.normal;
  return late;
}

/// Profiles are taken `late` off the points' places, and offsets count from there.
template <class Pixel>
void TargetObservations::observe_one(const EdgeMeter& meter, const PixelView<Pixel>& image,
                                     const TargetState& state, const Eigen::Isometry3d& pose,
                                     const Eigen::VectorXd& late,
                                     std::vector<Observation>& out) const {
  out.assign(static_cast<std::size_t>(points()), {});
  for (std::size_t t = 0; t < printed_.size(); ++t) {
    EdgeTag tag = edges(state, t);
    for (std::size_t i = 0; i < tag.points.size(); ++i)
      tag.points[i] = shifted(tag.points[i], late[first_[t] + static_cast<Eigen::Index>(i)]);
    std::vector<EdgeMeasurement> measured(tag.points.size());
    meter.measure(image, tag, pose, kHalf_px, false, measured);
    const double gain = median_gain(measured);
    for (std::size_t i = 0; i < measured.size(); ++i) {
      if (!measured[i].valid) continue;
      Observation& seen = out[static_cast<std::size_t>(first_[t]) + i];
      seen.valid = true;
      seen.by = edge_derivatives(meter.camera(), measured[i], pose, rest_pose_,
                                 state.camera_T_tag[t], {tag.points[i].x, tag.points[i].y, 0});
      seen.offset = measured[i].offset_px / gain;
    }
  }
}

void TargetObservations::observe(const std::vector<Keyframe>& frames, const TargetState& state) {
  observe_one(EdgeMeter(with_focal(rest_.camera, state.focal_ratio)), rest_view(), state,
              rest_pose_, Eigen::VectorXd::Zero(points()), at_rest_);
  moving_.resize(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Keyframe& frame = frames[k];
    // Profiles are short: an edge that is far from where it is looked for is found too near.
    const Eigen::VectorXd late = lateness(moving_[k], state.readout);
    observe_one(EdgeMeter(with_focal(frame.camera, state.focal_ratio)), frame.view(), state,
                state.poses[k], late, moving_[k]);
    // A row is read before or after the middle one, by its part of the read-out time.
    const double middle = 0.5 * (frame.image_rows - 1) - frame.first_row;
    for (std::size_t p = 0; p < moving_[k].size(); ++p) {
      Observation& seen = moving_[k][p];
      seen.by.readout =
          seen.by.frame.dot(frame.velocity) * (seen.by.row_px - middle) / frame.image_rows;
      seen.offset += late[p] * seen.by.normal - seen.by.readout * state.readout;
    }
  }
}

void TargetObservations::learn_noise() {
  noise_px_ = Eigen::VectorXd::Zero(points());
  std::vector<double> all;
  for (Eigen::Index p = 0; p < points(); ++p) {
    std::vector<double> offsets;
    for (const auto& frame : moving_) {
      const Observation& seen = frame[p];
      if (seen.valid) offsets.push_back(std::abs(seen.offset));
    }
    if (offsets.size() < kFewSeen) continue;
    noise_px_[p] = kMadToSigma * median(offsets);
    all.push_back(noise_px_[p]);
  }
  const double typical = std::max(kMinNoise_px, median(all));
  for (double& noise : noise_px_)
    noise = noise > 0 ? std::max(noise, kMinNoiseFraction * typical) : typical;
}

void TargetObservations::learn_scatter(const TargetState& state) {
  scatter_ = print_scatter(printed_, first_, off_print(state));
}

double TargetObservations::rest_weight(Eigen::Index point) const {
  const double variance = noise_px_[point] * noise_px_[point];
  return 1 / (variance / std::max(1, rest_.image.frames) + kRestFloor_px * kRestFloor_px);
}

double TargetObservations::weight(const Observation& seen, Eigen::Index point) const {
  if (!seen.valid) return 0;
  const double noise = noise_px_[point];
  return biweight(seen.offset / (kTukey95 * noise)) /
         (noise * noise + static_cast<double>(moving_.size()) * kModel_px * kModel_px);
}

double TargetObservations::print_weight(double off) const {
  const double print = std::min(1.0, kHuber95 * scatter_.robust / std::abs(off)) /
                       (scatter_.effective * scatter_.effective);
  return std::max(print, 1 / (kSpreadPrior * kSpreadPrior));
}

TargetNormal TargetObservations::equations(const TargetState& state, bool at_rest_only,
                                           bool square) const {
  const int frames = at_rest_only ? 0 : static_cast<int>(moving_.size());
  TargetNormal normal(frames, static_cast<int>(printed_.size()), points());
  normal.add_prior(normal.readout_index(), -state.readout, 1 / (kReadoutPrior * kReadoutPrior));
  double size = 0;
  for (const PrintModes& print : state.print) size += print[kSizeMode];
  normal.add_total_size(-size, 1 / (kTotalSize * kTotalSize));
  const Eigen::VectorXd off = off_print(state);
  for (std::size_t t = 0; t < printed_.size(); ++t) {
    const int tag = static_cast<int>(t);
    const PrintModes weights = print_weights(state.print[t], square);
    for (int mode = 0; mode < kPrintModes; ++mode)
      normal.add_prior(normal.print_index(tag) + mode, -state.print[t][mode], weights[mode]);
    for (Eigen::Index p = first_[t]; p < first_[t + 1]; ++p) {
      normal.add_print(p, tag,
                       print_row(printed_[t].points[static_cast<std::size_t>(p - first_[t])]),
                       -off[p], print_weight(off[p]));
      for_each_offset(p, [&](const Observation& seen, int frame, double weight) {
        if (frame < frames) normal.add({frame, tag, p, seen.by, seen.offset, weight});
      });
    }
  }
  return normal;
}

}  // namespace tagwrench
