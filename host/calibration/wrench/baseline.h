// Where a record counts from: the rests around it, and what drifts between them.
#pragma once

#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/types.h"

namespace tagwrench {

/// Of one zero: its rests, in the order of their times.
class Baseline {
 public:
  /// `records` may hold other zeros too.
  Baseline(const WrenchPlan& plan, const std::vector<StepRecord>& records, int zero);

  bool empty() const { return rests_.empty(); }
  /// Displacement of the first rest, m and rad.
  const Vector6& displacement() const { return rests_.front().displacement; }
  /// What the displacement has drifted since then: linear between rests, constant beyond.
  Vector6 drift(double time) const;
  /// Of drift() between two rests: that of a change that may have come at any moment.
  Matrix6 drift_covariance(double time) const;
  /// What the reference says when nothing is applied.
  Vector6 reading(double time) const;

 private:
  struct Rest {
    double time = 0;
    Vector6 displacement = Vector6::Zero();
    Vector6 reading = Vector6::Zero();
  };
  /// The rests around `time` and the share of the later one.
  struct Between {
    const Rest* before;
    const Rest* after;
    double share;
  };
  Between between(double time) const;

  std::vector<Rest> rests_;
};

}  // namespace tagwrench
