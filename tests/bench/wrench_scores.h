// Held-out figures of every method beside each other.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "tests/bench/table.h"
#include "tests/bench/wrench_readings.h"

namespace tagwrench::bench {

using SixFigures = std::array<double, 6>;

inline const std::array<std::string, 6> kAxisHeads = {"Fx", "Fy", "Fz", "Mx", "My", "Mz"};
inline const std::array<std::string, 6> kMilliHeads = {"Fx mN",   "Fy mN",   "Fz mN",
                                                       "Mx mN m", "My mN m", "Mz mN m"};
SixFigures in_milli(SixFigures figures);

struct Scored {
  Readings readings;
  study::Analysis analysis;
  SixFigures r2{}, rmse{};  ///< held out; N, N m
};

/// Five blocks in time, affine fit, one lag found inside each fold: the same for every method.
Scored scored(const Readings& readings, const ReferenceRecord& reference);

/// RMS of what each held-out prediction is off from the wrench that was applied, whatever the
/// reference said: N and N m about the reference's origin.
SixFigures error_from_truth(const Scored& scored, const sim::Scenario& scenario,
                            const ReferenceRecord& reference);

/// R^2, RMSE, lag and time of each.
void print(const std::vector<Scored>& all, Table& table);

}  // namespace tagwrench::bench
