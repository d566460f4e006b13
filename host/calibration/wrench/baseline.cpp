#include "host/calibration/wrench/baseline.h"

#include <algorithm>

namespace tagwrench {

Baseline::Baseline(const WrenchPlan& plan, const std::vector<StepRecord>& records, int zero) {
  for (const StepRecord& record : records) {
    if (record.zero != zero || record.frames.empty() ||
        plan.steps[static_cast<std::size_t>(record.step)].kind != StepKind::rest)
      continue;
    const RecordMean mean = mean_of(record);
    rests_.push_back({mean.time, mean.displacement, mean_reading(record)});
  }
}

Baseline::Between Baseline::between(double time) const {
  const auto after = std::find_if(rests_.begin(), rests_.end(),
                                  [time](const Rest& rest) { return rest.time > time; });
  if (after == rests_.begin()) return {&*after, &*after, 0};
  const Rest& before = *(after - 1);
  if (after == rests_.end()) return {&before, &before, 0};
  return {&before, &*after, (time - before.time) / (after->time - before.time)};
}

Vector6 Baseline::drift(double time) const {
  const auto [before, after, share] = between(time);
  return (1 - share) * before->displacement + share * after->displacement - displacement();
}

Matrix6 Baseline::drift_covariance(double time) const {
  const auto [before, after, share] = between(time);
  const Vector6 change = after->displacement - before->displacement;
  return change * change.transpose() / 12;  // variance of a uniform distribution over the change
}

Vector6 Baseline::reading(double time) const {
  const auto [before, after, share] = between(time);
  return (1 - share) * before->reading + share * after->reading;
}

}  // namespace tagwrench
