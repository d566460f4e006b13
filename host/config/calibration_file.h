// calibration.json -> WrenchModel.
#pragma once

#include <string>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"

namespace tagwrench {

/// Reads K, B, the calibrated range and the model's covariance into `model`; leaves the tool
/// transform alone.
///
///   {"format": "tagwrench-calibration-1",
///    "sensor": {"family": "aruco_original", "tag_ids": [5, 2], "tag_size_mm": 3.8, "image_px":
///    [640, 480]}, "K": [[6 numbers] x 6],           wrench = K d + B, SI, about the platform
///    origin, camera axes "B": [6 numbers], "range": [6 numbers],             +- N, N m
///    "covariance": [[6 numbers] x 6]}  of the fit, optional
///
/// Throws ConfigError if the file cannot be read, is not such a file, or was made for another
/// sensor.
void load_calibration(const std::string& path, const CameraModel& camera,
                      const TargetDescription& target, WrenchModel& model);

}  // namespace tagwrench
