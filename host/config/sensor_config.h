// sensor.yaml -> the plain structs that the rooms take. Every check and message is here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"
#include "host/wrench/shaping.h"

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

struct SensorConfig {
  CameraModel camera;
  std::optional<CameraRecord> camera_calibrated;
  double camera_latency = 0;  ///< from the middle of the exposure to the frame's time, s
  TargetDescription target;
  RestOptions rest;
  WrenchModel wrench;
  ShapingOptions shaping;
  HidIdentity spacemouse;
};

/// Throws ConfigError: "file:line: key: what is wrong and what to do".
SensorConfig load_sensor(const std::string& path);
SensorConfig parse_sensor(const std::string& text, const std::string& name);

}  // namespace tagwrench
