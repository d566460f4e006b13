// calibration.json: the wrench model, the sensor that it belongs to, and what it rests on.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/sensor/measured_files.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"
#include "host/wrench/fit.h"

namespace tagwrench {

/// One lag for all axes of the reference, s.
struct CalibrationLag {
  double value = 0;
  double sigma = 0;
};

/// How a calibration came about; all of it may be absent.
struct CalibrationRecord {
  std::string date;      ///< YYYY-MM-DDThh:mm:ssZ
  std::string software;  ///< "tagwrench 0.1.0"
  std::string plan;
  std::string reference;  ///< the instrument, or "masses"
  std::string notes;      ///< environment: temperature, place, who
  std::string data_file;  ///< beside calibration.json
  std::string data_sha256;
  std::optional<CalibrationLag> lag;
  std::optional<std::array<AxisFit, 6>> axis;
  std::optional<std::array<double, 6>> inside_95;
  std::vector<std::string> missing;
  std::vector<std::string> warnings;
  std::vector<ModelTrial> trials;
};

struct Calibration {
  SensorIdentity sensor;
  WrenchModel model;  ///< without tool transform
  CalibrationRecord record;
};

/// The file's form; keys may be added, none goes away:
///
///   {"format": "tagwrench-calibration-1",
///    "sensor": {"family": "aruco_original", "tag_ids": [5, 2], "tag_size_mm": 3.8,
///               "image_px": [640, 480],
///               "lens_px": [fx, fy, cx, cy], "target_sha256": "..."},            optional
///    "K": [[6 numbers] x 6],   wrench = K d + B, SI, about the platform origin, camera axes
///    "B": [6 numbers],
///    "range": [6 numbers],     +- N, N m; 1e9 where it is not known
///    "covariance": [[6 numbers] x 6],            of the model's error at rest, optional
///    "model": {"kind": "linear" | "quadratic" | "creep" | "hysteresis", "time_constant_s": T,
///              "play": [6 numbers], "extra": [[6 numbers] x further features]},       optional
///    "parameter_covariance": [[1 number], [2 numbers], ...],      lower triangle, of (K, extra, B)
///                                                                 column by column, optional
///    "error": {"at_full_load": [6 numbers], "full_load": [6 numbers]},                optional
///    "date", "software", "plan", "reference", "notes": texts,                         optional
///    "data": {"file": "...", "sha256": "..."}, "lag_s": {"value": x, "sigma": x},     optional
///    "axes": [{"name": "Fx", "state": "calibrated", "reason": "", ...} x 6], "inside_95": [6],
///    "missing": [texts], "warnings": [texts], "tried": [{"kind": ..., "score": ...}]  optional
///   }
///
/// Throws ConfigError if it cannot be read or is not such a file.
Calibration read_calibration(const std::filesystem::path& path);

/// What read_calibration() reads.
std::string calibration_text(const Calibration& calibration);

/// What people are told of a calibration that is in force.
struct CalibrationFacts {
  std::string completed_axes;  ///< that it leaves to the spring model, "Fx Mz"; empty: none, or it
                               ///< does not tell
  std::string date;            ///< when it was made; empty: it does not tell
};

/// Reads the model's numbers into `model`; leaves the tool transform alone. Throws ConfigError as
/// read_calibration, and if it was made for another sensor or another target, saying which.
CalibrationFacts load_calibration(const std::string& path, const CameraModel& camera,
                                  const TargetDescription& target, const ReferenceOptions& rest,
                                  WrenchModel& model);

}  // namespace tagwrench
