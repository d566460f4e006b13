#include "tests/bench/wrench_scores.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/source/simulator/trajectory.h"

namespace tagwrench::bench {
SixFigures in_milli(SixFigures figures) {
  for (double& figure : figures) figure *= 1e3;
  return figures;
}

Scored scored(const Readings& readings, const ReferenceRecord& reference) {
  Scored result{readings, study::analyze({trial_of(readings, reference)}, {}), {}, {}};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    result.r2[axis] = result.analysis.axis[axis].r2;
    result.rmse[axis] = result.analysis.axis[axis].rmse;
  }
  return result;
}

SixFigures error_from_truth(const Scored& scored, const sim::Scenario& scenario,
                            const ReferenceRecord& reference) {
  const sim::TrajectoryPlayer hand(scenario.trajectory, scenario.seed);
  const study::Analysis& analysis = scored.analysis;
  Vector6 squares = Vector6::Zero();
  for (Eigen::Index i = 0; i < analysis.time.size(); ++i) {
    const Vector6 applied = moved_to(reference.origin, hand.applied_wrench(analysis.time[i]));
    squares += (Vector6(analysis.predicted.row(i).transpose()) - applied).cwiseAbs2();
  }
  SixFigures result{};
  const auto count = static_cast<double>(analysis.time.size());
  Vector6::Map(result.data()) = (squares / count).cwiseSqrt();
  return result;
}

void print(const std::vector<Scored>& all, Table& table) {
  table.columns("held-out R^2", kAxisHeads);
  for (const Scored& s : all) table.figures(s.readings.name, s.r2, 6);
  table.columns("held-out RMSE", kMilliHeads);
  for (const Scored& s : all) table.figures(s.readings.name, in_milli(s.rmse), 4);
  table.line("");
  table.line(fmt::format("{:<42}{:>12}{:>9}{:>15}{:>14}", "", "frames held", "lag ms", "of folds",
                         "us per frame"));
  for (const Scored& s : all) {
    double least = INFINITY, most = -INFINITY;
    for (const study::Fold& fold : s.analysis.folds) {
      least = std::min(least, 1e3 * fold.lag.value);
      most = std::max(most, 1e3 * fold.lag.value);
    }
    table.line(
        fmt::format("{:<42}{:>12}{:>9.1f}{:>15}{:>14}", s.readings.name,
                    fmt::format("{}/{}", s.readings.time.size(), s.readings.frames),
                    1e3 * s.analysis.lag.value, fmt::format("{:.1f}..{:.1f}", least, most),
                    s.readings.median_us > 0 ? fmt::format("{:.0f}", s.readings.median_us) : "-"));
  }
}

}  // namespace tagwrench::bench
