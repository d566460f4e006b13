// A calibration that was recorded, once more: the same frames through the tracker, the same
// stretches of them as were accepted then.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/app/input.h"
#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/recording/reader.h"

namespace tagwrench {

/// Of a step that was accepted and still counted in the end.
struct AcceptedStep {
  int step = 0;            ///< of the plan
  int zero = 0;            ///< steps with one number count from one rest
  TimePoint from{}, to{};  ///< first and last frame
  std::int64_t id = 0;     ///< of the acceptance: later readings were not known by then
};

/// In the order in which they were accepted. Throws ConfigError: there are none, or they do not fit
/// the plan.
std::vector<AcceptedStep> accepted_steps(record::RecordingReader& recording,
                                         const WrenchPlan& plan);

/// Tracks all frames of `input` and gives each step what it had in the calibration itself.
/// `readings` is at its beginning. Throws ConfigError: a step has nothing to go by.
std::vector<StepRecord> replay_steps(Input& input, record::RecordingReader& readings,
                                     const std::vector<AcceptedStep>& steps,
                                     const WrenchPlan& plan);

/// Steps of the plan that are not there, for people: "step 3 (...), step 4 (...)"; empty: none.
std::string not_recorded(const std::vector<AcceptedStep>& steps, const WrenchPlan& plan);

}  // namespace tagwrench
