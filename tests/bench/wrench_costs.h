// The calibrated model: what it knows of its own errors, and what it costs.
#pragma once

#include "tests/bench/table.h"
#include "tests/bench/wrench_readings.h"

namespace tagwrench::bench {

/// Fits the calibration's model to `readings`, `lag` (s) behind the reference, in five blocks in
/// time that are held out in turn; then times the fit, and one sample of the running estimator
/// beside what tracking costs. `usual_us` is the paper's pipeline, per frame.
void bench_fit(const Readings& readings, const ReferenceRecord& reference, double lag,
               double usual_us, Table& table);

}  // namespace tagwrench::bench
