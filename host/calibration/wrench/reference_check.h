// Whether what a reference said while the platform was pushed or moved can be believed.
#pragma once

#include <string>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/types.h"

namespace tagwrench {

struct ReferenceFinding {
  enum class Verdict : std::uint8_t {
    fine,
    again,     ///< this step cannot be used; another try may be better
    hopeless,  ///< every step will be like this until something is put right
  };
  Verdict verdict = Verdict::fine;
  std::string text;  ///< what is wrong and what to do, one line
};

/// `rest`: the record of the rest before. `stiffness`: of the spring model; `range`: full load.
ReferenceFinding check_reference(const WrenchPlan& plan, const StepRecord& record,
                                 const StepRecord& rest, const Matrix6& stiffness,
                                 const Vector6& range);

/// Readings of a record as wrenches on the platform, counted from the rest before: m x 6. A push
/// takes hold of its point where that is at rest.
Eigen::MatrixXd reference_wrenches(const WrenchPlan& plan, const StepRecord& record,
                                   const StepRecord& rest);

}  // namespace tagwrench
