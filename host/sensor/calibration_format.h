// The keys that reading and writing calibration.json share.
#pragma once

#include <array>
#include <string>
#include <utility>

#include "host/core/axis_names.h"
#include "host/sensor/calibration_file.h"

namespace tagwrench {

inline constexpr const char* kCalibrationFormat = "tagwrench-calibration-1";

inline constexpr std::array<std::pair<const char*, double AxisFit::*>, 7> kAxisNumbers{
    {{"coverage", &AxisFit::coverage},
     {"gain_sigma", &AxisFit::gain_sigma},
     {"largest", &AxisFit::largest},
     {"held_out_rmse", &AxisFit::held_out_rmse},
     {"held_out_r2", &AxisFit::held_out_r2},
     {"error_constant", &AxisFit::error_constant},
     {"error_proportional", &AxisFit::error_proportional}}};

inline constexpr std::array<std::pair<const char*, std::string CalibrationRecord::*>, 5>
    kRecordTexts{{{"date", &CalibrationRecord::date},
                  {"software", &CalibrationRecord::software},
                  {"plan", &CalibrationRecord::plan},
                  {"reference", &CalibrationRecord::reference},
                  {"notes", &CalibrationRecord::notes}}};

}  // namespace tagwrench
