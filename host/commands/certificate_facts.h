// A calibration as the lines that a certificate shows of it.
#pragma once

#include <vector>

#include "host/calibration/certificate/certificate.h"
#include "host/sensor/calibration_file.h"

namespace tagwrench {

std::vector<Fact> sensor_facts(const SensorIdentity& sensor);
std::vector<Fact> procedure_facts(const Calibration& calibration);

/// What the calibration knows better than an analysis of its data: which axes are calibrated,
/// coverage of the intervals that it states, and its warnings.
void add_calibration(const CalibrationRecord& record, study::Analysis& analysis);

}  // namespace tagwrench
