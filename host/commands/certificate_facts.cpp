#include "host/commands/certificate_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "host/calibration/analysis/analysis_warnings.h"
#include "host/calibration/analysis/metrics.h"
#include "host/calibration/certificate/certificate.h"
#include "host/core/axis_names.h"

namespace tagwrench {
namespace {

constexpr std::size_t kHashShown = 16;  // hexadecimal digits

void add(std::vector<Fact>& facts, const char* name, const std::string& value) {
  if (!value.empty()) facts.push_back({name, value});
}

std::string model_text(const Calibration& calibration) {
  const std::string kind(name(calibration.model.features.kind));
  const std::size_t tried = calibration.record.trials.size();
  return tried > 1 ? fmt::format("{}, the best of {} on data held out", kind, tried)
                   : kind + ", 6 x 6 with offset";
}

/// Of the fit's own cross-validation, which knows masses and lines of action.
std::string rmse_text(const std::array<AxisFit, 6>& axes) {
  std::vector<std::string> parts;
  for (int i = 0; i < 6; ++i) {
    const AxisFit& axis = axes[static_cast<std::size_t>(i)];
    if (axis.state == AxisState::calibrated)
      parts.push_back(fmt::format("{}\u00a0{}", kWrenchAxes[static_cast<std::size_t>(i)],
                                  load_text(axis.held_out_rmse, i)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Those that change with what the calibration says of its axes.
std::vector<std::string> axis_warnings(const study::Analysis& analysis) {
  std::vector<std::string> lines = study::excitation_warnings(analysis);
  for (std::string& line : study::coverage_warnings(analysis)) lines.push_back(std::move(line));
  return lines;
}

}  // namespace

std::vector<Fact> sensor_facts(const SensorIdentity& sensor) {
  std::vector<Fact> facts;
  add(facts, "Tags",
      fmt::format("{} {} of {:g} mm", sensor.family, fmt::join(sensor.tag_ids, ", "),
                  sensor.tag_size_mm));
  add(facts, "Camera", fmt::format("{} x {} px", sensor.image_px[0], sensor.image_px[1]));
  if (sensor.lens_px) {
    const auto& lens = *sensor.lens_px;
    add(facts, "Lens",
        fmt::format("focal length {:.1f}, {:.1f} px; centre {:.1f}, {:.1f} px", lens[0], lens[1],
                    lens[2], lens[3]));
  }
  add(facts, "Target as learned",
      sensor.target_sha256.empty() ? "not recorded"
                                   : "SHA-256 " + sensor.target_sha256.substr(0, kHashShown) + "…");
  add(facts, "Wrench", "applied to the platform, about its origin at rest, camera axes");
  return facts;
}

std::vector<Fact> procedure_facts(const Calibration& calibration) {
  const CalibrationRecord& record = calibration.record;
  std::vector<Fact> facts;
  add(facts, "Date", record.date);
  add(facts, "Plan", record.plan);
  add(facts, "Reference", record.reference);
  add(facts, "Model", model_text(calibration));
  // With an instrument each reading counts, with masses the mean of each hold, which has less
  // noise.
  if (record.axis)
    add(facts, record.lag ? "RMSE in its fit" : "Each hold's mean, RMSE", rmse_text(*record.axis));
  add(facts, "Software", record.software);
  add(facts, "Environment", record.notes.empty() ? "not noted" : record.notes);
  return facts;
}

void add_calibration(const CalibrationRecord& record, study::Analysis& analysis) {
  for (const std::string& line : axis_warnings(analysis)) std::erase(analysis.warnings, line);
  std::vector<std::string> remarks;
  for (std::size_t i = 0; i < 6; ++i) {
    study::AxisReport& report = analysis.axis[i];
    if (record.inside_95) report.coverage = (*record.inside_95)[i];
    if (!record.axis) continue;
    const AxisFit& axis = (*record.axis)[i];
    if (axis.state != AxisState::calibrated) {
      report.calibrated = false;
      report.reason = axis.reason.empty() ? name(axis.state)
                                          : fmt::format("{}: {}", name(axis.state), axis.reason);
    } else if (!report.calibrated && analysis.own_predictions && report.full_scale > 0) {
      report.calibrated = true;
      report.reason.clear();
      // The fit has all readings together and judges the axis; one reading's score cannot.
      const std::string why =
          report.excitation < study::kMinExcitation
              ? fmt::format(
                    "the scores on held-out readings hold the reference's own noise, which "
                    "the load exceeds {:.0f} times only",
                    report.excitation)
              : "but it was never loaded without the others, so that its scores are theirs too";
      remarks.push_back(fmt::format("{}: calibrated, its answer known to {:.1f} %; {}",
                                    kWrenchAxes[i], std::max(0.1, 100 * axis.gain_sigma), why));
    }
  }
  for (const std::string& line : axis_warnings(analysis)) remarks.push_back(line);
  analysis.warnings.insert(analysis.warnings.begin(), remarks.begin(), remarks.end());
  for (const std::string& warning : record.warnings) {
    if (std::find(analysis.warnings.begin(), analysis.warnings.end(), warning) ==
        analysis.warnings.end())
      analysis.warnings.push_back(warning);
  }
}

}  // namespace tagwrench
