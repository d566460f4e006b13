#include "host/calibrate_wrench/result.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/config/sensor_edit.h"
#include "host/config/sha256.h"
#include "host/study/trial_csv.h"
#include "host/zero_command.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// As sensor.yaml names it: relative to itself where they share a folder.
std::string name_from(const fs::path& sensor, const fs::path& file) {
  const fs::path folder = fs::absolute(sensor).lexically_normal().parent_path();
  const fs::path full = fs::absolute(file).lexically_normal();
  const fs::path written = full.parent_path() == folder ? full.filename() : full;
  std::string name = "'";
  for (const char c : written.string()) name += c == '\'' ? std::string("''") : std::string(1, c);
  return name + "'";
}

std::string axis_line(int i, const AxisFit& axis, double full_load, double inside) {
  const double milli = 1e3;
  std::string line =
      fmt::format("{}  {:9}  to {:7.1f} {:5}", kWrenchAxes[static_cast<std::size_t>(i)],
                  axis.state == AxisState::calibrated ? "calibrated" : "NOT", milli * axis.largest,
                  i < 3 ? "mN" : "mN m");
  if (axis.state != AxisState::calibrated)
    return line + fmt::format("  {}: {}", name(axis.state), axis.reason);
  return line + fmt::format(
                    "  held out {:8.3f} {} rms, {:5.2f} % of full load, R2 {:.5f}, {:.0f} % "
                    "within 95 %",
                    milli * axis.held_out_rmse, i < 3 ? "mN" : "mN m",
                    100 * axis.held_out_rmse / full_load, axis.held_out_r2, 100 * inside);
}

}  // namespace

CalibrationFiles files_of(const fs::path& calibration) {
  fs::path data = calibration;
  data.replace_extension(".data.csv");
  return {calibration, data, fs::path(calibration) += ".partial",
          fs::path(calibration) += ".before"};
}

void write_calibration(const CalibrationFiles& files, const std::string& sensor_text,
                       const fs::path& sensor_file, const SensorConfig& sensor,
                       const WrenchData& data, Calibration calibration) {
  const std::string csv = study::trial_to_csv(data.trial);
  calibration.record.data_file = files.data.filename().string();
  calibration.record.data_sha256 = sha256_hex(csv);
  std::vector<YamlEntry> entries = {{"calibration", name_from(sensor_file, files.calibration)}};
  for (const YamlEntry& entry : without_zero(sensor)) entries.push_back(entry);
  std::error_code none;
  if (fs::exists(files.calibration, none))
    write_atomically(files.before, read_text(files.calibration));
  write_atomically(files.data, csv);
  save_calibration(files.calibration, calibration);
  write_sensor(sensor_text, {{"wrench", entries}}, sensor_file);
}

std::vector<std::string> describe(const WrenchPlan& plan, const WrenchData& data,
                                  const WrenchFit& fit, const Vector6& range) {
  std::vector<std::string> lines;
  for (int i = 0; i < 6; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    lines.push_back(axis_line(i, fit.axis[axis], range[i], fit.inside_95[axis]));
  }
  for (const ModelTrial& trial : fit.trials) {
    const bool best = std::none_of(fit.trials.begin(), fit.trials.end(), [&](const ModelTrial& t) {
      return t.features.kind == trial.features.kind && t.score < trial.score;
    });
    if (!best) continue;  // of its kind
    lines.push_back(
        fmt::format("model {}: held-out squared error {:.3g} +- {:.2g} of the linear "
                    "one's; {}",
                    name(trial.features.kind), trial.score, trial.score_sigma,
                    trial.adopted ? "adopted" : "not adopted"));
  }
  for (const BlockFit& block : fit.blocks) {
    if (block.rejected) lines.push_back("left out: " + block.remark);
  }
  if (data.lag.known) {
    // The study counts from the reference to the reading; people ask how late the reference is.
    lines.push_back(fmt::format("the reference comes {:.1f} +- {:.1f} ms after the camera",
                                -1e3 * data.lag.value, 1e3 * data.lag.sigma));
    if (const std::string warning = study::lag_warning(data.lag, -0.2, 0.2); !warning.empty())
      lines.push_back(warning);
  }
  for (const std::string& missing : fit.missing)
    lines.push_back("completed from the spring model: " + missing);
  for (const std::string& warning : fit.warnings) lines.push_back(warning);
  lines.push_back(
      fmt::format("{} loads and rests of plan {}", data.observations.size(), plan.name));
  return lines;
}

}  // namespace tagwrench
