// A simulated sensor whose geometry is known: from the simulator, or from a calibration.
#pragma once

#include <vector>

#include "host/calibration/target/recorder.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/rotation.h"

namespace tagwrench::test {

/// Places as the simulator glued the tags.
inline SensorConfig with_true_places(SensorConfig sensor, const sim::Scenario& scenario) {
  const std::vector<sim::PlacedTag> placed = sim::placed_tags(scenario);
  for (std::size_t t = 0; t < placed.size(); ++t) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = placed[t].platform_T_tag.rotation;
    pose.translation() = placed[t].platform_T_tag.position;
    sensor.target.tags[t].platform_T_tag = pose;
  }
  return sensor;
}

/// From a recording of its own: a person tilts and pushes. Throws ConfigError if that is refused.
inline SensorConfig calibrated(SensorConfig sensor, sim::Scenario scenario) {
  scenario.trajectory = {};
  scenario.trajectory.amplitude = {0.45, 0.45, 2.3, 0.007, 0.007, 0.006};  // N, N m
  TargetRecorder record(sensor.camera, sensor.target, sensor.rest, 100);
  SimulatorSource source(scenario, /*live=*/false);
  constexpr double kCalibrationTime = 9;  // s
  const int frames = static_cast<int>(kCalibrationTime * scenario.camera.frame_rate);
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    source.read(frame);
    record.add(frame);
  }
  check_record(record, sensor.target, sensor.rest);
  const TargetEstimate estimate = adjust_target(record.at_rest(), record.keyframes());
  check_estimate(estimate, sensor.target, sensor.camera);
  sensor.target = calibrated_target(sensor.target, estimate);
  sensor.rest.camera_T_platform = midpoint_frame(estimate.camera_T_tag);
  sensor.rest.appearance = record.at_rest().image;
  return sensor;
}

}  // namespace tagwrench::test
