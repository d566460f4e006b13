#include "host/sensor/calibration_file.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/os/text_file.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr const char* kCalibrationFormat = "tagwrench-calibration-1";

constexpr std::array<std::pair<const char*, double AxisFit::*>, 7> kAxisNumbers{
    {{"coverage", &AxisFit::coverage},
     {"gain_sigma", &AxisFit::gain_sigma},
     {"largest", &AxisFit::largest},
     {"held_out_rmse", &AxisFit::held_out_rmse},
     {"held_out_r2", &AxisFit::held_out_r2},
     {"error_constant", &AxisFit::error_constant},
     {"error_proportional", &AxisFit::error_proportional}}};

constexpr std::array<std::pair<const char*, std::string CalibrationRecord::*>, 5> kRecordTexts{
    {{"date", &CalibrationRecord::date},
     {"software", &CalibrationRecord::software},
     {"plan", &CalibrationRecord::plan},
     {"reference", &CalibrationRecord::reference},
     {"notes", &CalibrationRecord::notes}}};

constexpr std::uintmax_t kMaxFile = 16 << 20;  // a quadratic model has 0.4 MB
constexpr double kMax = 1e12;                  // of any number, SI ...
constexpr double kMaxCovariance = 1e24;        // ... but its square: of N/m^2, 1 N at 1 um

std::string text_of(const std::filesystem::path& path) {
  try {
    return read_text(path, kMaxFile);
  } catch (const ConfigError& e) {
    throw ConfigError(
        "{}; run `tagwrench calibrate wrench`, or remove wrench.calibration to use springs",
        e.what());
  }
}

/// Every access checks; every complaint names the file.
class CalibrationReader {
 public:
  explicit CalibrationReader(const std::filesystem::path& path) : path_(path.string()) {
    root_ = parse_json(text_of(path));
    if (!root_.is_object())
      fail("is not a JSON object; it was cut short or is another kind of file");
    if (root_.value("format", json()) != kCalibrationFormat) {
      fail(fmt::format(
          "\"format\" is not \"{}\"; it is not a calibration, or one of another version",
          kCalibrationFormat));
    }
  }

  const json& at(const json& object, const std::string& key) const {
    if (!object.is_object() || !object.contains(key)) fail(fmt::format("\"{}\" is missing", key));
    return object.at(key);
  }
  const json& at(const std::string& key) const { return at(root_, key); }
  bool has(const std::string& key) const { return root_.contains(key); }
  static bool has(const json& object, const std::string& key) {
    return object.is_object() && object.contains(key);
  }

  double number(const json& value, const std::string& key, double largest = kMax) const {
    if (!value.is_number()) fail(fmt::format("\"{}\" must be a number", key));
    const double out = value.get<double>();
    if (!std::isfinite(out)) fail(fmt::format("\"{}\" holds a number that is not finite", key));
    if (std::abs(out) > largest)
      fail(fmt::format("\"{}\" holds {:g}, which no sensor has; calibrate anew", key, out));
    return out;
  }

  std::vector<double> numbers(const json& list, const std::string& key, std::size_t count,
                              double largest = kMax) const {
    const auto refuse = [&] {
      fail(fmt::format("\"{}\" must have {} number{}", key, count, count == 1 ? "" : "s"));
    };
    if (!list.is_array() || list.size() != count) refuse();
    std::vector<double> out;
    for (const json& value : list) {
      if (!value.is_number()) refuse();
      out.push_back(number(value, key, largest));
    }
    return out;
  }

  Vector6 vector6(const json& list, const std::string& key) const {
    return Vector6(numbers(list, key, 6).data());
  }

  Vector6 non_negative6(const json& list, const std::string& key) const {
    const Vector6 out = vector6(list, key);
    if ((out.array() < 0).any()) fail(fmt::format("\"{}\" must not be negative", key));
    return out;
  }

  Matrix6 matrix6(const std::string& key) const {
    const json& rows = at(key);
    if (!rows.is_array() || rows.size() != 6)
      fail(fmt::format("\"{}\" must be 6 rows of 6 numbers", key));
    Matrix6 out;
    for (int r = 0; r < 6; ++r) out.row(r) = vector6(rows[r], key).transpose();
    return out;
  }

  std::string text(const json& value, const std::string& key) const {
    constexpr std::size_t kMaxText = 10'000;
    if (!value.is_string() || value.get_ref<const std::string&>().size() > kMaxText)
      fail(fmt::format("\"{}\" must be a text", key));
    return value.get<std::string>();
  }

  std::vector<std::string> texts(const std::string& key) const {
    std::vector<std::string> out;
    if (!has(key)) return out;
    if (!at(key).is_array() || at(key).size() > 1000)
      fail(fmt::format("\"{}\" must be a list of texts", key));
    for (const json& value : at(key)) out.push_back(text(value, key));
    return out;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw ConfigError("{}: {}", path_, message);
  }

 private:
  std::string path_;
  json root_;
};

SensorIdentity read_sensor(const CalibrationReader& file) {
  const json& node = file.at("sensor");
  SensorIdentity sensor;
  sensor.family = file.text(file.at(node, "family"), "family");
  const auto integer = [&](const json& value, const char* key) {
    const double number = file.number(value, key);
    if (number != std::floor(number) || std::abs(number) > 1e6)
      file.fail(fmt::format("\"{}\" must be whole numbers", key));
    return static_cast<int>(number);
  };
  const json& ids = file.at(node, "tag_ids");
  if (!ids.is_array() || ids.size() > kMaxTags)
    file.fail(fmt::format("\"tag_ids\" must be a list of at most {} ids", kMaxTags));
  for (const json& id : ids) sensor.tag_ids.push_back(integer(id, "tag_ids"));
  sensor.tag_size_mm = file.number(file.at(node, "tag_size_mm"), "tag_size_mm");
  const json& image = file.at(node, "image_px");
  if (!image.is_array() || image.size() != 2) file.fail("\"image_px\" must be [width, height]");
  sensor.image_px = {integer(image[0], "image_px"), integer(image[1], "image_px")};
  if (file.has(node, "lens_px")) {
    const std::vector<double> lens = file.numbers(node["lens_px"], "lens_px", 4);
    sensor.lens_px = {lens[0], lens[1], lens[2], lens[3]};
  }
  if (file.has(node, "target_sha256"))
    sensor.target_sha256 = file.text(node["target_sha256"], "target_sha256");
  return sensor;
}

/// In units in which its diagonal is one, as forces and torques differ by orders of magnitude.
void check_covariance(const CalibrationReader& file, const std::string& key,
                      const Eigen::MatrixXd& covariance) {
  if ((covariance.diagonal().array() < 0).any())
    file.fail(fmt::format("\"{}\" has a negative variance on its diagonal", key));
  const Eigen::VectorXd unit = covariance.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? 1 / std::sqrt(variance) : 0.0; });
  Eigen::MatrixXd scaled = unit.asDiagonal() * covariance * unit.asDiagonal();
  for (Eigen::Index i = 0; i < unit.size(); ++i) {
    if (unit[i] == 0 && covariance.row(i).cwiseAbs().maxCoeff() > 0)
      file.fail(fmt::format("\"{}\" is no covariance: a number without variance varies", key));
    scaled(i, i) = 1;
  }
  const bool symmetric = (scaled - scaled.transpose()).cwiseAbs().maxCoeff() < 1e-6;
  scaled.diagonal().array() += 1e-6;
  if (!symmetric || !scaled.allFinite() ||
      Eigen::LLT<Eigen::MatrixXd>(scaled).info() != Eigen::Success)
    file.fail(fmt::format("\"{}\" is no covariance: not positive semidefinite", key));
}

FeatureSpec read_features(const CalibrationReader& file, const json& node) {
  FeatureSpec features;
  const std::string kind = file.text(file.at(node, "kind"), "kind");
  const auto known = std::find(kFeatureNames.begin(), kFeatureNames.end(), kind);
  if (known == kFeatureNames.end()) {
    file.fail(fmt::format("\"kind\" is \"{}\", which this version does not know; update tagwrench",
                          kind));
  }
  features.kind = static_cast<FeatureKind>(known - kFeatureNames.begin());
  if (features.kind == FeatureKind::creep) {
    features.time_constant = file.number(file.at(node, "time_constant_s"), "time_constant_s");
    if (features.time_constant <= 0) file.fail("\"time_constant_s\" must be greater than 0");
  }
  if (features.kind == FeatureKind::hysteresis)
    features.play = file.non_negative6(file.at(node, "play"), "play");
  return features;
}

void read_extra(const CalibrationReader& file, const json& node, WrenchModel& model) {
  const int further = feature_count(model.features.kind) - 6;
  const json& rows = file.at(node, "extra");
  if (!rows.is_array() || rows.size() != static_cast<std::size_t>(further))
    file.fail(fmt::format("\"extra\" must have {} rows of 6 numbers", further));
  model.extra.resize(6, further);
  for (int k = 0; k < further; ++k)
    model.extra.col(k) = file.vector6(rows[static_cast<std::size_t>(k)], "extra");
}

Eigen::MatrixXd read_lower_triangle(const CalibrationReader& file, const std::string& key,
                                    int size) {
  const json& rows = file.at(key);
  if (!rows.is_array() || rows.size() != static_cast<std::size_t>(size))
    file.fail(fmt::format("\"{}\" must have {} rows", key, size));
  Eigen::MatrixXd out(size, size);
  for (int i = 0; i < size; ++i) {
    const auto count = static_cast<std::size_t>(i) + 1;
    const std::vector<double> row =
        file.numbers(rows[static_cast<std::size_t>(i)], key, count, kMaxCovariance);
    for (int j = 0; j <= i; ++j) out(i, j) = out(j, i) = row[static_cast<std::size_t>(j)];
  }
  check_covariance(file, key, out);
  return out;
}

void read_model(const CalibrationReader& file, WrenchModel& model) {
  model.K = file.matrix6("K");
  model.B = file.vector6(file.at("B"), "B");
  model.range = file.vector6(file.at("range"), "range");
  if ((model.range.array() <= 0).any()) file.fail("\"range\" must be greater than 0 on every axis");
  if (file.has("covariance")) {
    model.model_covariance = file.matrix6("covariance");
    check_covariance(file, "covariance", model.model_covariance);
  }
  if (file.has("model")) {
    model.features = read_features(file, file.at("model"));
    read_extra(file, file.at("model"), model);
  }
  if (file.has("parameter_covariance")) {
    model.parameter_covariance = read_lower_triangle(file, "parameter_covariance",
                                                     6 * (feature_count(model.features.kind) + 1));
  }
  if (file.has("error")) {
    const json& error = file.at("error");
    model.error_at_full_load = file.non_negative6(file.at(error, "at_full_load"), "at_full_load");
    model.full_load = file.vector6(file.at(error, "full_load"), "full_load");
    if ((model.full_load.array() <= 0).any()) file.fail("\"full_load\" must be greater than 0");
  }
}

AxisFit read_axis(const CalibrationReader& file, const json& node) {
  AxisFit axis;
  const std::string state = file.text(file.at(node, "state"), "state");
  const auto known = std::find(kAxisStateNames.begin(), kAxisStateNames.end(), state);
  if (known == kAxisStateNames.end())
    file.fail(fmt::format("\"state\" of an axis is \"{}\"", state));
  axis.state = static_cast<AxisState>(known - kAxisStateNames.begin());
  axis.reason = file.text(file.at(node, "reason"), "reason");
  for (const auto& [key, member] : kAxisNumbers)
    axis.*member = file.number(file.at(node, key), key);
  return axis;
}

ModelTrial read_trial(const CalibrationReader& file, const json& node) {
  ModelTrial trial;
  trial.features = read_features(file, node);
  trial.score = file.number(file.at(node, "score"), "score");
  trial.score_sigma = file.number(file.at(node, "score_sigma"), "score_sigma");
  const json& adopted = file.at(node, "adopted");
  if (!adopted.is_boolean()) file.fail("\"adopted\" must be true or false");
  trial.adopted = adopted.get<bool>();
  return trial;
}

CalibrationRecord read_record(const CalibrationReader& file) {
  CalibrationRecord record;
  for (const auto& [key, member] : kRecordTexts)
    if (file.has(key)) record.*member = file.text(file.at(key), key);
  if (file.has("data")) {
    record.data_file = file.text(file.at(file.at("data"), "file"), "file");
    record.data_sha256 = file.text(file.at(file.at("data"), "sha256"), "sha256");
  }
  if (file.has("lag_s")) {
    const json& lag = file.at("lag_s");
    record.lag = {file.number(file.at(lag, "value"), "lag_s"),
                  file.number(file.at(lag, "sigma"), "lag_s")};
  }
  if (file.has("axes")) {
    const json& axes = file.at("axes");
    if (!axes.is_array() || axes.size() != 6) file.fail("\"axes\" must have 6 entries");
    record.axis.emplace();
    for (std::size_t i = 0; i < 6; ++i) (*record.axis)[i] = read_axis(file, axes[i]);
  }
  if (file.has("inside_95")) {
    const std::vector<double> inside = file.numbers(file.at("inside_95"), "inside_95", 6);
    std::copy(inside.begin(), inside.end(), record.inside_95.emplace().begin());
  }
  record.missing = file.texts("missing");
  record.warnings = file.texts("warnings");
  if (file.has("tried")) {
    const json& tried = file.at("tried");
    if (!tried.is_array() || tried.size() > 1000) file.fail("\"tried\" must be a list");
    for (const json& trial : tried) record.trials.push_back(read_trial(file, trial));
  }
  return record;
}

using nlohmann::ordered_json;

ordered_json list(const Eigen::VectorXd& values) {
  return std::vector<double>(values.begin(), values.end());
}

ordered_json rows(const Eigen::MatrixXd& matrix, bool lower_triangle = false) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    out.push_back(list(matrix.row(i).head(lower_triangle ? i + 1 : matrix.cols()).transpose()));
  return out;
}

ordered_json sensor_json(const SensorIdentity& sensor) {
  ordered_json out{{"family", sensor.family},
                   {"tag_ids", sensor.tag_ids},
                   {"tag_size_mm", sensor.tag_size_mm},
                   {"image_px", sensor.image_px}};
  if (sensor.lens_px) out["lens_px"] = *sensor.lens_px;
  if (!sensor.target_sha256.empty()) out["target_sha256"] = sensor.target_sha256;
  return out;
}

ordered_json features_json(const FeatureSpec& features) {
  ordered_json out{{"kind", std::string(name(features.kind))}};
  if (features.kind == FeatureKind::creep) out["time_constant_s"] = features.time_constant;
  if (features.kind == FeatureKind::hysteresis) out["play"] = list(features.play);
  return out;
}

ordered_json axis_json(const char* axis_name, const AxisFit& axis) {
  ordered_json out{{"name", axis_name}, {"state", name(axis.state)}, {"reason", axis.reason}};
  for (const auto& [key, member] : kAxisNumbers) out[key] = axis.*member;
  return out;
}

void add_record(const CalibrationRecord& record, ordered_json& out) {
  for (const auto& [key, member] : kRecordTexts)
    if (!(record.*member).empty()) out[key] = record.*member;
  if (!record.data_sha256.empty())
    out["data"] = {{"file", record.data_file}, {"sha256", record.data_sha256}};
  if (record.lag) out["lag_s"] = {{"value", record.lag->value}, {"sigma", record.lag->sigma}};
  if (record.axis)
    for (std::size_t i = 0; i < 6; ++i)
      out["axes"].push_back(axis_json(kWrenchAxes[i], (*record.axis)[i]));
  if (record.inside_95) out["inside_95"] = *record.inside_95;
  if (record.axis) out["missing"] = record.missing;
  if (!record.warnings.empty()) out["warnings"] = record.warnings;
  for (const ModelTrial& trial : record.trials) {
    ordered_json tried = features_json(trial.features);
    tried["score"] = trial.score;
    tried["score_sigma"] = trial.score_sigma;
    tried["adopted"] = trial.adopted;
    out["tried"].push_back(std::move(tried));
  }
}

}  // namespace

Calibration read_calibration(const std::filesystem::path& path) {
  const CalibrationReader file(path);
  Calibration out;
  out.sensor = read_sensor(file);
  read_model(file, out.model);
  out.record = read_record(file);
  return out;
}

CalibrationFacts load_calibration(const std::string& path, const CameraModel& camera,
                                  const TargetDescription& target, const ReferenceOptions& rest,
                                  WrenchModel& model) {
  const CalibrationReader file(path);
  const std::string differs = difference(read_sensor(file), identity_of(camera, target, rest));
  if (!differs.empty()) {
    file.fail(
        fmt::format("was made for another sensor: {}; run `tagwrench calibrate wrench` for this "
                    "one, or remove it",
                    differs));
  }
  WrenchModel read;
  read_model(file, read);
  read.wrench_origin = model.wrench_origin;
  read.camera_R_wrench_frame = model.camera_R_wrench_frame;
  model = read;

  CalibrationFacts facts;
  if (file.has("date")) facts.date = file.text(file.at("date"), "date");
  if (!file.has("axes")) return facts;
  const json& axes = file.at("axes");
  for (std::size_t i = 0; axes.is_array() && i < std::min<std::size_t>(6, axes.size()); ++i) {
    if (file.has(axes[i], "state") && axes[i]["state"] != name(AxisState::calibrated))
      facts.completed_axes +=
          (facts.completed_axes.empty() ? "" : " ") + std::string(kWrenchAxes[i]);
  }
  return facts;
}

std::string calibration_text(const Calibration& calibration) {
  const WrenchModel& model = calibration.model;
  ordered_json out{{"format", kCalibrationFormat},
                   {"sensor", sensor_json(calibration.sensor)},
                   {"K", rows(model.K)},
                   {"B", list(model.B)},
                   {"range", list(model.range)},
                   {"covariance", rows(model.model_covariance)},
                   {"model", features_json(model.features)}};
  out["model"]["extra"] = rows(model.extra.transpose());
  if (model.parameter_covariance.size() > 0) {
    out["parameter_covariance"] = rows(model.parameter_covariance, true);
    out["error"] = {{"at_full_load", list(model.error_at_full_load)},
                    {"full_load", list(model.full_load)}};
  }
  add_record(calibration.record, out);
  // Texts of people may hold anything; what is no UTF-8 is replaced.
  return dump_json(out, 1) + "\n";
}

}  // namespace tagwrench
