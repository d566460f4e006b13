// Room sensor: one physical sensor, as files have it.
// In:  sensor.yaml (mm, N/mm, px), what was measured beside it. Every key: docs/sensor-yaml.md.
// Out: CameraModel, TargetDescription, ReferenceOptions, WrenchModel, shaping; SI, frames as in
//      core/types.h. ConfigError with file, line, key and remedy for all that is wrong.
//
// sensor.yaml -> the plain structs that the rooms take. Every check and message is here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/motion/profile_config.h"
#include "host/motion/shaping.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

/// The identity under which the virtual SpaceMouse presents itself.
struct HidIdentity {
  std::uint16_t vendor = 0x256f;   ///< 3Dconnexion
  std::uint16_t product = 0xc62e;  ///< SpaceMouse Wireless: one combined 6-axis report
};

/// How the camera was calibrated.
struct CameraRecord {
  std::string date;  ///< YYYY-MM-DD
  int views = 0;
  double rms_px = 0;  ///< reprojection error
};

/// What is taken off the wrench, and whether it may follow what the sensor reads
/// at rest (host/wrench/zero.h).
struct ZeroConfig {
  Vector6 set = Vector6::Zero();  ///< about the platform's origin, camera axes, N and N m
  std::string date;               ///< when `tagwrench zero` found it; empty: never
  bool follow = true;
  double band = 0.02;        ///< of the range
  double rate = 0.5 / 3000;  ///< of the range a second
};

/// A load cell that stays on the sensor for good, and the line along which it acts.
struct ReferenceLine {
  int channel = 0;                                       ///< of the board
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       ///< where it takes hold, platform frame, m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of the force on the platform when the
                                                         ///< cell reads more than 0, camera axes
};

/// Which file tells something, for people.
struct InForce {
  std::string file = "sensor.yaml";  ///< or one of measured/, or another that sensor.yaml names
  std::string date;                  ///< YYYY-MM-DD; empty: not told
  std::string unfinished{};          ///< what a measurement that was killed has left; empty: none
};

struct SensorConfig {
  CameraModel camera;
  std::optional<CameraRecord> camera_calibrated;
  double camera_latency = 0;  ///< from the middle of the exposure to the frame's time, s
  TargetDescription target;
  ReferenceOptions rest;
  WrenchModel wrench;
  std::optional<Matrix6> spring_stiffness;  ///< of wrench.springs, also where a calibration is used
  std::string calibration;                  ///< path of the one in force; empty: none
  std::string completed_axes;               ///< that it left to the spring model: "Fx Mz"
  ZeroConfig zero;
  std::optional<ReferenceLine> reference;  ///< a load cell that is there for good
  ShapingOptions shaping;
  HidIdentity spacemouse;
  InForce camera_from, target_from, wrench_from, zero_from;
};

/// How much of what was measured counts, for those who do not need it, or are about to replace it.
/// Each leaves out what the one before it leaves out, too.
enum class WrenchCalibration : std::uint8_t {
  use,             ///< all of it; it must belong together
  zero_that_fits,  ///< a zero that belongs to another calibration is left out
  ignore,          ///< no calibration in newtons, no zero: the springs', or nothing
  without_target,  ///< nor places, rest and its picture: sensor.yaml's, without the picture
  without_camera,  ///< nothing that lies in measured/
};

/// sensor.yaml and the files of measured/ beside it, which win over it. Throws ConfigError:
/// "file:line: key: what is wrong and what to do".
SensorConfig load_sensor(const std::string& path, WrenchCalibration use = WrenchCalibration::use);

/// Of a text that stands for the file `name`. `measured`: the folder of what was measured; empty:
/// nothing was.
SensorConfig parse_sensor(const std::string& text, const std::string& name,
                          WrenchCalibration use = WrenchCalibration::use,
                          const std::filesystem::path& measured = {});

/// Lines for people: which file tells camera, target, wrench and zero, and of when.
std::vector<std::string> in_force(const SensorConfig& sensor);

/// The profile of a sensor for which nobody has chosen one: the sensor's own shaping and mounting,
/// gestures scaled to its range, none of which does anything.
Profile default_profile(const SensorConfig& sensor);

/// Of the following of zero. `tool` is WrenchEstimator::tool() of this sensor; `may_follow`: false
/// keeps the zero where it is set.
inline ZeroOptions zero_options(const SensorConfig& sensor, const Matrix6& tool, bool may_follow) {
  return {.follow = may_follow && sensor.zero.follow,
          .range = range_through(tool, sensor.wrench.range),
          .set = tool * sensor.zero.set,
          .band = sensor.zero.band,
          .rate = sensor.zero.rate};
}

}  // namespace tagwrench
