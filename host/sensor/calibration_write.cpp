#include <nlohmann/json.hpp>

#include "host/core/json/json_text.h"
#include "host/core/os/atomic_file.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/calibration_format.h"

namespace tagwrench {
namespace {

using nlohmann::ordered_json;

template <typename Vector>
ordered_json list(const Vector& values) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(values[i]);
  return out;
}

template <typename Matrix>
ordered_json rows(const Matrix& matrix) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    out.push_back(list(matrix.row(i).transpose().eval()));
  return out;
}

ordered_json lower_triangle(const Eigen::MatrixXd& matrix) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    out.push_back(list(matrix.row(i).head(i + 1).transpose().eval()));
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
  ordered_json out{{"name", axis_name}};
  out["state"] = name(axis.state);
  out["reason"] = axis.reason;
  for (const auto& [key, member] : kAxisNumbers) out[key] = axis.*member;
  return out;
}

void add_record(const CalibrationRecord& record, ordered_json& out) {
  for (const auto& [key, member] : kRecordTexts) {
    if (!(record.*member).empty()) out[key] = record.*member;
  }
  if (!record.data_sha256.empty())
    out["data"] = {{"file", record.data_file}, {"sha256", record.data_sha256}};
  if (record.lag) out["lag_s"] = {{"value", record.lag->value}, {"sigma", record.lag->sigma}};
  if (record.axis) {
    for (std::size_t i = 0; i < 6; ++i)
      out["axes"].push_back(axis_json(kWrenchAxes[i], (*record.axis)[i]));
  }
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

void save_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  const WrenchModel& model = calibration.model;
  ordered_json out{{"format", kCalibrationFormat}, {"sensor", sensor_json(calibration.sensor)}};
  out["K"] = rows(model.K);
  out["B"] = list(model.B);
  out["range"] = list(model.range);
  out["covariance"] = rows(model.model_covariance);
  out["model"] = features_json(model.features);
  out["model"]["extra"] = rows(model.extra.transpose().eval());
  if (model.parameter_covariance.size() > 0) {
    out["parameter_covariance"] = lower_triangle(model.parameter_covariance);
    out["error"] = {{"at_full_load", list(model.error_at_full_load)},
                    {"full_load", list(model.full_load)}};
  }
  add_record(calibration.record, out);
  // Texts of people may hold anything; what is no UTF-8 is replaced.
  write_atomically(path, dump_json(out, 1) + "\n");
}

}  // namespace tagwrench
