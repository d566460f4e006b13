#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/calibration/wrench/load.h"
#include "host/calibration/wrench/reference.h"

namespace tagwrench {
namespace {

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
  const Eigen::ArrayXd x = a.array() - a.mean();
  const Eigen::ArrayXd y = b.array() - b.mean();
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
    const Eigen::VectorXd a = said(rows, axis);
    const Eigen::VectorXd b = expected(rows, axis);
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

Eigen::MatrixXd reference_wrenches(const WrenchPlan& plan, const StepRecord& record,
                                   const StepRecord& rest) {
  const Vector6 zero = mean_reading(rest);
  Eigen::MatrixXd out(static_cast<Eigen::Index>(record.readings.size()), 6);
  Observation observation;
  for (std::size_t i = 0; i < record.readings.size(); ++i) {
    const Vector6 value = record.readings[i].value - zero;
    if (plan.reference == ReferenceKind::load_cell) {
      set_push(plan, record.step, {value[0], 0, 0}, Vector6::Zero(), observation);
      out.row(static_cast<Eigen::Index>(i)) = observation.wrench.transpose();
    } else {
      out.row(static_cast<Eigen::Index>(i)) = six_axis_wrench(plan, value).transpose();
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
  segment.time = frame_times(record);
  segment.features.resize(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TrackedFrame& frame = record.frames[static_cast<std::size_t>(i)];
    segment.features.row(i) = (stiffness * (frame.displacement - zero)).transpose();
  }
  segment.reference_time = reading_times(record);
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
