// A recording of the simulated sensor for a calibration of the target, and what is true about it.
#pragma once

#include "host/calibration/target/recorder.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/rotation.h"

namespace tagwrench::test {

struct Recording {
  sim::Scenario scenario;
  SensorConfig sensor;
  sim::Truth truth;  ///< of the last frame; placement is the same in all
  std::unique_ptr<TargetRecorder> record;

  /// `frames` pictures of the scenario. The sensor believes in `focal_ratio` times the true focal
  /// length. From frame `covered_from` on the lens is covered.
  Recording(const sim::Scenario& described, int frames, double focal_ratio = 1,
            int covered_from = 1'000'000)
      : scenario(described),
        sensor(parse_sensor(sim::sensor_yaml(described), "the test's sensor")) {
    sensor.camera.fx_px *= focal_ratio;
    sensor.camera.fy_px *= focal_ratio;
    record = std::make_unique<TargetRecorder>(sensor.camera, sensor.target, sensor.rest, 100);
    SimulatorSource source(scenario, /*live=*/false);
    const std::vector<std::uint8_t> dark(
        static_cast<std::size_t>(sensor.camera.width_px) * sensor.camera.height_px, 10);
    for (int i = 0; i < frames; ++i) {
      Frame frame;
      source.read(frame);
      if (i >= covered_from) frame.image.pixels = dark.data();
      record->add(frame);
    }
    truth = source.truth();
  }

  /// camera_T_tag at rest.
  Eigen::Isometry3d true_tag(std::size_t tag) const {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = truth.tags[tag].platform_T_tag.rotation;
    pose.translation() = truth.tags[tag].platform_T_tag.position + truth.rest_position;
    return pose;
  }
};

/// Rough print, uneven light, defocus, distortion and JPEG, moved by a hand along all axes.
inline sim::Scenario realistic(std::uint64_t seed) {
  sim::Scenario scenario;
  scenario.seed = seed;
  scenario.camera.fx_px = scenario.camera.fy_px = 700;
  scenario.trajectory.amplitude = {0.45, 0.45, 2.3, 0.007, 0.007, 0.006};
  scenario.trajectory.rest_time = 1.0;
  scenario.noise = {2.0, 0.0};  // 2 grey levels
  scenario.compression.jpeg_quality = 85;
  return scenario;
}

}  // namespace tagwrench::test
