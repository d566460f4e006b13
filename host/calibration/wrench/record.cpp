#include "host/calibration/wrench/record.h"

#include <algorithm>

namespace tagwrench {
namespace {

constexpr double kNoises = 4;  // standard deviations of the tracker's noise that are no motion
constexpr int kMinFrames = 5;  // a mean and a slope of fewer tell nothing
// This share of the tracker's noise variance does not average away over a second: errors of
// geometry and grey levels stay while the platform stands.
constexpr double kSlowShare = 0.05;

template <class Item>
Eigen::VectorXd times(const std::vector<Item>& items) {
  Eigen::VectorXd t(static_cast<Eigen::Index>(items.size()));
  for (std::size_t i = 0; i < items.size(); ++i) t[static_cast<Eigen::Index>(i)] = items[i].time;
  return t;
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

Eigen::VectorXd frame_times(const StepRecord& record) { return times(record.frames); }
Eigen::VectorXd reading_times(const StepRecord& record) { return times(record.readings); }

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

}  // namespace tagwrench
