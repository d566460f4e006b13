// Room sensor: one physical sensor, as files have it.
// In:  sensor.yaml (mm, N/mm, px), what was measured beside it. Every key: docs/sensor-yaml.md.
// Out: CameraModel, TargetDescription, ReferenceOptions, WrenchModel, shaping; SI, frames as in
//      core/types.h. ConfigError with file, line, key and remedy for all that is wrong.
//
// sensor.yaml -> the plain structs that the rooms take. Every check and message is here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host/motion/shaping.h"
#include "host/sensor/reference_line.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"

namespace tagwrench {

/// The identity under which the virtual SpaceMouse presents itself.
struct HidIdentity {
  std::uint16_t vendor = 0x256f;   ///< 3Dconnexion
  std::uint16_t product = 0xc62e;  ///< SpaceMouse Wireless: one combined 6-axis report
};

/// What `tagwrench calibrate camera` wrote about its work.
struct CameraRecord {
  std::string date;  ///< YYYY-MM-DD
  int views = 0;
  double rms_px = 0;  ///< reprojection error
};

/// wrench.zero_...: what is taken off the wrench, and whether it may follow what the sensor reads
/// at rest (host/wrench/zero.h).
struct ZeroConfig {
  Vector6 set = Vector6::Zero();  ///< about the platform's origin, camera axes, N and N m
  std::string date;               ///< when `tagwrench zero` found it; empty: never
  bool follow = true;
  double band = 0.02;        ///< of the range
  double rate = 0.5 / 3000;  ///< of the range a second
};

struct SensorConfig {
  CameraModel camera;
  std::optional<CameraRecord> camera_calibrated;
  double camera_latency = 0;  ///< from the middle of the exposure to the frame's time, s
  TargetDescription target;
  ReferenceOptions rest;
  WrenchModel wrench;
  std::optional<Matrix6> spring_stiffness;  ///< of wrench.springs, also where a calibration is used
  std::string calibration;                  ///< path of wrench.calibration; empty: none
  std::string completed_axes;               ///< that it left to the spring model: "Fx Mz"
  ZeroConfig zero;
  std::optional<ReferenceLine> reference;  ///< a load cell that is there for good
  ShapingOptions shaping;
  HidIdentity spacemouse;
};

/// What becomes of wrench.calibration.
enum class WrenchCalibration : std::uint8_t {
  use,     ///< it must be there and belong to this sensor
  ignore,  ///< for those who do not need newtons, or are about to replace it: the springs', or zero
};

/// Throws ConfigError: "file:line: key: what is wrong and what to do".
SensorConfig load_sensor(const std::string& path, WrenchCalibration use = WrenchCalibration::use);
SensorConfig parse_sensor(const std::string& text, const std::string& name,
                          WrenchCalibration use = WrenchCalibration::use);

}  // namespace tagwrench
