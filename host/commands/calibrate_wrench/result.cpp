#include "host/commands/calibrate_wrench/result.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/sha256.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;

constexpr const char* kFormat = "tagwrench-calibrating-1";
constexpr std::size_t kFrameNumbers = 1 + 6 + 21;       // time, displacement, lower triangle
constexpr std::size_t kReadingNumbers = 1 + 6 + 6 + 1;  // time, value, sigma, saturated
constexpr double kMax = 1e12;

json frame_json(const TrackedFrame& frame) {
  json row = {frame.time};
  for (const double v : frame.displacement) row.push_back(v);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) row.push_back(frame.covariance(i, j));
  return row;
}

json reading_json(const ReferenceSample& sample) {
  json row = {sample.time};
  for (const double v : sample.value) row.push_back(v);
  for (const double v : sample.sigma) row.push_back(v);
  row.push_back(sample.saturated ? 1 : 0);
  return row;
}

class ProgressReader {
 public:
  ProgressReader(const std::filesystem::path& path, const WrenchPlan& plan)
      : path_(path), plan_(plan), root_(parse_json(read_text(path))) {
    if (!root_.is_object() || root_.value("format", json()) != kFormat)
      fail("is not an interrupted calibration; remove it and start anew without --resume");
  }

  void check(const ProgressOf& of) const {
    if (root_.value("plan_sha256", json()) != of.plan_sha256)
      fail("belongs to another plan; give that one, or remove the file and start anew");
    if (root_.value("sensor_sha256", json()) != of.sensor_sha256)
      fail("belongs to another sensor; give that one, or remove the file and start anew");
  }

  Progress read() const {
    Progress progress;
    for (const json& s : list(root_, "skipped")) progress.skipped.push_back(step(s));
    for (const json& r : list(root_, "records")) {
      if (!r.is_object()) damaged();
      StepRecord record;
      record.step = step(r.value("step", json()));
      const json zero = r.value("zero", json());
      if (!zero.is_number_unsigned() || zero.get<std::uint64_t>() > 100'000) damaged();
      record.zero = zero.get<int>();
      for (const json& row : list(r, "frames")) record.frames.push_back(frame(row));
      for (const json& row : list(r, "readings")) record.readings.push_back(reading(row));
      if (record.frames.empty()) damaged();
      progress.records.push_back(std::move(record));
    }
    if (!zeros_fit(progress.records, plan_)) damaged();
    return progress;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw ConfigError("{}: {}", path_.string(), message);
  }
  [[noreturn]] void damaged() const {
    fail("is damaged; remove it and start anew without --resume");
  }
  json list(const json& object, const char* key) const {
    json value = object.value(key, json());
    if (!value.is_array() || value.size() > 1'000'000) damaged();
    return value;
  }
  int step(const json& value) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= plan_.steps.size()) damaged();
    return value.get<int>();
  }
  std::vector<double> numbers(const json& row, std::size_t count) const {
    if (!row.is_array() || row.size() != count) damaged();
    std::vector<double> out;
    for (const json& v : row) {
      if (!v.is_number()) damaged();
      out.push_back(v.get<double>());
      if (!(std::abs(out.back()) < kMax)) damaged();
    }
    return out;
  }
  TrackedFrame frame(const json& row) const {
    const std::vector<double> v = numbers(row, kFrameNumbers);
    TrackedFrame out;
    std::size_t at = 0;
    out.time = v[at++];
    for (int i = 0; i < 6; ++i) out.displacement[i] = v[at++];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j) out.covariance(i, j) = out.covariance(j, i) = v[at++];
    return out;
  }
  ReferenceSample reading(const json& row) const {
    const std::vector<double> v = numbers(row, kReadingNumbers);
    ReferenceSample out;
    out.time = v[0];
    for (int i = 0; i < 6; ++i) {
      out.value[i] = v[static_cast<std::size_t>(1 + i)];
      out.sigma[i] = v[static_cast<std::size_t>(7 + i)];
    }
    out.saturated = v.back() != 0;
    return out;
  }

  std::filesystem::path path_;
  const WrenchPlan& plan_;
  json root_;
};

constexpr double kLittle = 0.5;  // of the range

/// How well the loads of the held-out predictions were known themselves, rms, N and N m.
Vector6 known_to(const WrenchData& data, const WrenchFit& fit) {
  Vector6 sum = Vector6::Zero();
  for (const HeldOut& h : fit.held_out) {
    const Observation& o = data.observations[h.observation];
    sum += o.wrench_covariance.diagonal();
    for (const CorrelatedError& error : o.common) sum += error.effect.cwiseAbs2();
  }
  if (!fit.held_out.empty()) sum /= static_cast<double>(fit.held_out.size());
  return sum.cwiseSqrt();
}

std::string axis_line(int i, const AxisFit& axis, double range, double reference, double inside) {
  const double milli = 1e3;
  const char* name_of_axis = kWrenchAxes[static_cast<std::size_t>(i)];
  const char* unit = i < 3 ? "mN" : "mN m";
  if (axis.state != AxisState::calibrated)
    return fmt::format("{}    NOT calibrated, {}: {}", name_of_axis, name(axis.state), axis.reason);
  return fmt::format("{} {:9.1f} {:4} {:9.2f} {:4} {:6.2f} % {:9.2f} {:4} {:8.0f} %", name_of_axis,
                     milli * axis.largest, unit, milli * axis.held_out_rmse, unit,
                     100 * axis.held_out_rmse / range, milli * reference, unit, 100 * inside);
}

/// Axes of which the loads reached less than half of the range; empty: none.
std::string little_loaded(const WrenchFit& fit, const Vector6& range) {
  std::string axes;
  for (int i = 0; i < 6; ++i) {
    const AxisFit& axis = fit.axis[static_cast<std::size_t>(i)];
    const bool little = axis.largest < kLittle * range[i] && range[i] < kUnknownRange;
    if (axis.state != AxisState::calibrated || !little) continue;
    const double scale = i < 3 ? 1 : 1e3;
    axes += fmt::format("{}{} {:.2f} of {:.2f} {}", axes.empty() ? "" : ", ",
                        kWrenchAxes[static_cast<std::size_t>(i)], scale * axis.largest,
                        scale * range[i], i < 3 ? "N" : "mN m");
  }
  if (axes.empty()) return {};
  return fmt::format(
      "loaded to less than half of the range: {}; beyond that it is the model's word", axes);
}

/// All that were tried, the best of each kind, in one line.
std::string trials_line(const std::vector<ModelTrial>& trials) {
  std::string tried;
  std::string_view adopted = "linear";
  for (const ModelTrial& trial : trials) {
    if (trial.adopted) adopted = name(trial.features.kind);
    const bool best = std::none_of(trials.begin(), trials.end(), [&](const ModelTrial& t) {
      return t.features.kind == trial.features.kind && t.score < trial.score;
    });
    if (!best) continue;
    tried += fmt::format("{}{} {:.2f} +- {:.2f}", tried.empty() ? "" : ", ",
                         name(trial.features.kind), trial.score, trial.score_sigma);
  }
  return fmt::format("model: {} (held-out squared error, linear = 1: {})", adopted, tried);
}

}  // namespace

void save_progress(const std::filesystem::path& path, const ProgressOf& of,
                   const Progress& progress) {
  json records = json::array();
  for (const StepRecord& record : progress.records) {
    json frames = json::array();
    for (const TrackedFrame& frame : record.frames) frames.push_back(frame_json(frame));
    json readings = json::array();
    for (const ReferenceSample& sample : record.readings) readings.push_back(reading_json(sample));
    records.push_back({{"step", record.step},
                       {"zero", record.zero},
                       {"frames", std::move(frames)},
                       {"readings", std::move(readings)}});
  }
  const json root = {{"format", kFormat},
                     {"plan_sha256", of.plan_sha256},
                     {"sensor_sha256", of.sensor_sha256},
                     {"skipped", progress.skipped},
                     {"records", std::move(records)}};
  std::error_code error;
  std::filesystem::create_directory(path.parent_path(),
                                    error);  // measured/, perhaps for the first time
  write_atomically(path, dump_json(root) + "\n");
}

Progress load_progress(const std::filesystem::path& path, const ProgressOf& of,
                       const WrenchPlan& plan) {
  const ProgressReader reader(path, plan);
  reader.check(of);
  return reader.read();
}

CalibrationFiles files_of(const fs::path& calibration) {
  fs::path data = calibration;
  data.replace_extension(".data.csv");
  return {calibration, data, fs::path(calibration) += ".partial",
          fs::path(calibration) += ".before"};
}

void check_some_axis(const WrenchFit& fit) {
  std::string reasons;
  for (std::size_t i = 0; i < 6; ++i) {
    if (fit.axis[i].state == AxisState::calibrated) return;
    reasons += fmt::format("{}{} ({})", i == 0 ? "" : ", ", kWrenchAxes[i], fit.axis[i].reason);
  }
  throw ConfigError(
      "calibration: no axis is known from these steps: {}; the calibration in force stays; take "
      "the steps again, with --force",
      reasons);
}

std::string what_is_lost(const CalibrationFiles& files, const WrenchFit& fit) {
  std::error_code none;
  if (!fs::exists(files.calibration, none)) return {};
  std::string lost;
  try {
    const CalibrationRecord before = read_calibration(files.calibration).record;
    for (std::size_t i = 0; before.axis && i < 6; ++i) {
      const bool knew = (*before.axis)[i].state == AxisState::calibrated;
      if (knew && fit.axis[i].state != AxisState::calibrated)
        lost += fmt::format("{}{}", lost.empty() ? "" : " ", kWrenchAxes[i]);
    }
  } catch (const ConfigError&) {
    return {};  // it is no calibration, and --force was given
  }
  if (lost.empty()) return {};
  return fmt::format("the calibration before knew {} by loads, this one does not; it is kept: {}",
                     lost, files.before.string());
}

void write_calibration(const CalibrationFiles& files, const WrenchData& data,
                       Calibration calibration) {
  const std::string csv = study::trial_to_csv(data.trial);
  calibration.record.data_file = files.data.filename().string();
  calibration.record.data_sha256 = sha256_hex(csv);
  std::error_code none;
  fs::create_directory(files.calibration.parent_path(), none);  // who writes says what is wrong
  NewFile fresh(files.calibration);
  fresh.write(calibration_text(calibration));
  try {
    read_calibration(fresh.temporary());
  } catch (const ConfigError& unusable) {
    throw ConfigError(
        "calibration: what came of these steps cannot be used ({}); the calibration in force "
        "stays; take the steps again, with --force",
        unusable.what());
  }
  if (fs::exists(files.calibration, none))
    write_atomically(files.before, read_text(files.calibration));
  if (fs::exists(files.data, none))
    write_atomically(fs::path(files.data) += ".before", read_text(files.data));
  write_atomically(files.data, csv);
  fresh.take_the_name();
}

std::vector<std::string> describe(const WrenchPlan& plan, const WrenchData& data,
                                  const WrenchFit& fit, const Vector6& range,
                                  const Vector6& known) {
  std::vector<std::string> lines = {
      "     loads up to   error held out   of range   loads known to   within 95 %"};
  const Vector6 reference = known_to(data, fit);
  for (int i = 0; i < 6; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    lines.push_back(axis_line(i, fit.axis[axis], range[i], reference[i], fit.inside_95[axis]));
  }
  if (const std::string little = little_loaded(fit, known); !little.empty())
    lines.push_back(little);
  lines.push_back(
      "error held out: rms, each step predicted by the others. The load's own uncertainty is in it "
      "(loads known to: rms), so where the two are alike the reference limits, not the sensor");
  lines.push_back(
      "within 95 %: how many of these errors their stated 95 % interval holds; 90 to 99 % is good");
  if (!fit.trials.empty()) lines.push_back(trials_line(fit.trials));
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
