#include "host/calibration/wrench/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr double kNoises = 4;  // standard deviations of the tracker's noise that are no motion
constexpr int kMinFrames = 5;  // a mean and a slope of fewer tell nothing
// This share of the tracker's noise variance does not average away over a second: errors of
// geometry and grey levels stay while the platform stands.
constexpr double kSlowShare = 0.05;

using Verdict = ReferenceFinding::Verdict;

constexpr double kMinShare = 0.8;    // of the time that readings must cover
constexpr double kWeakPush = 0.25;   // of what the plan asks for
constexpr double kStill = 0.03;      // of the range: an axis that moves less says nothing
constexpr double kNoRelation = 0.3;  // mean R^2 below which there is none
constexpr double kOpposite = -0.5;   // correlation

double deviation(const Eigen::VectorXd& v) {
  return std::sqrt((v.array() - v.mean()).square().mean());
}

double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::ArrayXd x = a.array() - a.mean(), y = b.array() - b.mean();
  const double norm = std::sqrt(x.square().sum() * y.square().sum());
  return norm > 0 ? (x * y).sum() / norm : 0;
}

/// Correlation of what the reference says with what the springs say, mean over the axes that move.
double agreement(const Eigen::MatrixXd& said, const Eigen::MatrixXd& expected,
                 const Vector6& range) {
  double sum = 0;
  int axes = 0;
  for (int axis = 0; axis < 6; ++axis) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < said.rows(); ++i)
      if (std::isfinite(said(i, axis))) rows.push_back(i);
    const Eigen::VectorXd a = said(rows, axis), b = expected(rows, axis);
    if (rows.size() < 10 || deviation(a) < kStill * range[axis]) continue;
    sum += correlation(a, b);
    ++axes;
  }
  return axes > 0 ? sum / axes : 0;
}

ReferenceFinding check_presence(const WrenchPlan& plan, const StepRecord& record) {
  const double span = record.frames.back().time - record.frames.front().time;
  if (record.readings.size() < 10 ||
      record.readings.back().time - record.readings.front().time < kMinShare * span)
    return {Verdict::again, "the reference was silent for a part of it; look at its plug"};
  if (std::any_of(record.readings.begin(), record.readings.end(),
                  [](const ReferenceSample& s) { return s.saturated; }))
    return {Verdict::again, "the reference was overloaded; do it more gently"};
  if (plan.reference != ReferenceKind::load_cell) return {};
  const auto [low, high] =
      std::minmax_element(record.readings.begin(), record.readings.end(),
                          [](const auto& a, const auto& b) { return a.value[0] < b.value[0]; });
  const double felt = high->value[0] - low->value[0];
  if (felt < kWeakPush * plan.step(record.step).force)
    return {
        Verdict::again,
        fmt::format("the cell felt no more than {:.2g} N of {:g} N; push harder (is it cell {}?)",
                    felt, plan.step(record.step).force, plan.cell_channel)};
  return {};
}

}  // namespace

HoldDetector::HoldDetector(const HoldOptions& options)
    : options_(options), to_load_(options.range.cwiseInverse().asDiagonal() * options.stiffness) {
  frames_.reserve(512);
}

void HoldDetector::add(const TrackedFrame& frame) {
  if (!frames_.empty()) {
    const double step = frame.time - frames_.back().time;
    if (step <= 0) return;
    if (step > 0.5 * options_.seconds) frames_.clear();
  }
  frames_.push_back(frame);
  // One frame beyond the window stays, so that it is known to be full.
  const auto old = std::find_if(frames_.begin(), frames_.end(), [&](const TrackedFrame& f) {
    return frame.time - f.time <= options_.seconds;
  });
  if (old - frames_.begin() > 1) frames_.erase(frames_.begin(), old - 1);
}

Hold HoldDetector::look() const {
  Hold hold;
  const auto n = static_cast<double>(frames_.size());
  if (frames_.empty()) return hold;
  hold.from = frames_.front().time;
  hold.to = frames_.back().time;
  hold.frames = static_cast<int>(frames_.size());
  hold.full = hold.frames >= kMinFrames && hold.to - hold.from >= 0.999 * options_.seconds;
  Matrix6 noise = Matrix6::Zero();
  double mean_time = 0;
  for (const TrackedFrame& f : frames_) {
    hold.mean += f.displacement / n;
    noise += f.covariance / n;
    mean_time += f.time / n;
  }
  Matrix6 scatter = Matrix6::Zero();
  Vector6 slope = Vector6::Zero();
  double spread = 0;
  for (const TrackedFrame& f : frames_) {
    const Vector6 off = f.displacement - hold.mean;
    scatter += off * off.transpose() / std::max(n - 1, 1.0);
    slope += (f.time - mean_time) * off;
    spread += (f.time - mean_time) * (f.time - mean_time);
  }
  if (spread > 0) slope /= spread;
  hold.covariance = scatter / n + kSlowShare * noise;
  const Vector6 deviation = (to_load_ * scatter * to_load_.transpose()).diagonal().cwiseSqrt();
  const Vector6 change = (to_load_ * slope).cwiseAbs() * (hold.to - hold.from);
  const Vector6 floor = (to_load_ * noise * to_load_.transpose()).diagonal().cwiseSqrt();
  const Vector6 limit = (kNoises * floor).cwiseMax(options_.steady);
  hold.unrest = deviation.cwiseMax(change).cwiseQuotient(limit).maxCoeff(&hold.worst);
  hold.steady = hold.full && hold.unrest <= 1;
  return hold;
}

RecordMean mean_of(const StepRecord& record) {
  if (record.frames.empty()) return {};
  HoldDetector hold({.seconds = 2 * (record.frames.back().time - record.frames.front().time) + 1});
  for (const TrackedFrame& frame : record.frames) hold.add(frame);
  const Hold all = hold.look();
  return {0.5 * (all.from + all.to), all.mean, all.covariance};
}

Vector6 mean_reading(const StepRecord& record) {
  Vector6 mean = Vector6::Zero();
  for (const ReferenceSample& sample : record.readings)
    mean += sample.value / static_cast<double>(record.readings.size());
  return mean;
}

Eigen::MatrixXd reference_wrenches(const WrenchPlan& plan, const StepRecord& record,
                                   const StepRecord& rest) {
  const Vector6 zero = mean_reading(rest);
  Eigen::MatrixXd out(record.readings.size(), 6);
  Observation observation;
  for (std::size_t i = 0; i < record.readings.size(); ++i) {
    const Vector6 value = record.readings[i].value - zero;
    if (plan.reference == ReferenceKind::load_cell) {
      set_push(plan, record.step, {value[0], 0, 0}, Vector6::Zero(), observation);
      out.row(i) = observation.wrench.transpose();
    } else {
      out.row(i) = six_axis_wrench(plan, value).transpose();
    }
  }
  return out;
}

ReferenceFinding check_reference(const WrenchPlan& plan, const StepRecord& record,
                                 const StepRecord& rest, const Matrix6& stiffness,
                                 const Vector6& range) {
  if (const ReferenceFinding found = check_presence(plan, record); found.verdict != Verdict::fine)
    return found;
  const auto n = static_cast<Eigen::Index>(record.frames.size());
  const Vector6 zero = mean_of(rest).displacement;
  study::Segment segment;
  segment.time = times_of(record.frames);
  segment.features.resize(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TrackedFrame& frame = record.frames[i];
    segment.features.row(i) = (stiffness * (frame.displacement - zero)).transpose();
  }
  segment.reference_time = times_of(record.readings);
  segment.reference = reference_wrenches(plan, record, rest);
  const study::Lag lag = study::estimate_lag({&segment, 1});
  if (!lag.known || lag.explained < kNoRelation)
    return {Verdict::again,
            "what the reference says has nothing to do with how the platform moves, at no lag: is "
            "it the instrument that this sensor is pushed with, and on this clock?"};
  const Eigen::MatrixXd said =
      study::reference_at(segment.time, lag.value, segment.reference_time, segment.reference, 0.1);
  if (agreement(said, segment.features, range) < kOpposite)
    return {Verdict::hopeless,
            plan.reference == ReferenceKind::load_cell
                ? "the load cell reads less the harder it is pushed: swap its wires A+ and A- and "
                  "calibrate it anew (tagwrench board calibrate-cell)"
                : "the reference reads the opposite of what the platform feels: give the plan the "
                  "other reference_sign"};
  return {};
}

}  // namespace tagwrench
