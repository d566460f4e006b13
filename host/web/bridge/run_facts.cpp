#include "host/web/bridge/run_facts.h"

#include <Eigen/Core>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "host/core/axis_names.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

using nlohmann::json;

/// Full scale per axis, as samples have it: what the calibration vouches for, else what the
/// sensor's shaping takes for full.
Vector6 shown_range(const SensorConfig& sensor) {
  const WrenchEstimator wrench(sensor.wrench);
  Vector6 range = range_through(wrench.tool(), sensor.wrench.range);
  for (int i = 0; i < 6; ++i) {
    if (!(range[i] > 0 && range[i] < kUnknownRange)) range[i] = 1.5 * sensor.shaping.full_scale[i];
  }
  return range;
}

}  // namespace

json hello_of(const RunFacts& facts, const std::string& recordings) {
  const SensorConfig& sensor = facts.sensor;
  json calibrated = nullptr;
  json from_springs = json::array();
  if (!sensor.calibration.empty() && !sensor.wrench_from.date.empty())
    calibrated = sensor.wrench_from.date;
  std::istringstream completed(sensor.completed_axes);
  for (std::string axis; completed >> axis;) from_springs.push_back(axis);
  if (sensor.calibration.empty()) {
    for (const char* axis : kWrenchAxes) from_springs.push_back(axis);
  }
  const Vector6 range = shown_range(sensor);
  json mounting = json::array();  // row by row
  for (int i = 0; i < 9; ++i) mounting.push_back(sensor.shaping.hid_R_camera(i / 3, i % 3));
  json cells = json::array();
  for (int i = 0; facts.board && i < 4; ++i) cells.push_back(i);
  return {{"type", "hello"},
          {"protocol", 1},
          {"version", TAGWRENCH_VERSION},
          {"name", facts.name},
          {"source", facts.format.description},
          {"sensor", facts.place.sensor.empty() ? "built in" : facts.place.sensor},
          {"camera",
           {{"width", facts.format.width},
            {"height", facts.format.height},
            {"mirrored", sensor.camera.mirrored}}},
          {"range_n", {range[0], range[1], range[2]}},
          {"range_nm", {range[3], range[4], range[5]}},
          {"hid_R_camera", mounting},
          {"calibrated", calibrated},
          {"axes_from_springs", from_springs},
          {"folder", recordings},
          {"can",
           {{"camera_settings", !facts.camera_device.empty()},
            {"led", facts.board},
            {"cells", cells},
            {"profiles", facts.profiles},
            {"record", facts.head.has_value()},
            {"jobs", possible_jobs(facts.place)}}}};
}

}  // namespace tagwrench
