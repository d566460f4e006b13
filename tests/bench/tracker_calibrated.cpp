#include "tests/bench/tracker_calibrated.h"

#include <random>
#include <vector>

#include "host/calibration/target/recorder.h"
#include "host/tracker/rotation.h"
#include "tests/bench/tracker_clip.h"

namespace tagwrench::bench {
namespace {

constexpr int kPoses = 20;
constexpr std::size_t kKeyframes = 150;
constexpr std::uint64_t kOtherNoise = 1'000'000;

/// Every way, as one does it who is told to tilt and push the platform slowly: up to 0.8 mm, 2
/// degrees about x and y, 3 about z.
std::vector<Vector6> pushed_about() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(-1, 1);
  std::vector<Vector6> poses(kPoses);
  for (Vector6& pose : poses) {
    pose << 0.8e-3, 0.8e-3, 0.8e-3, 0.035, 0.035, 0.05;
    for (double& number : pose) number *= share(random);
  }
  return poses;
}

}  // namespace

SensorConfig calibrated(const SensorConfig& sensor, const sim::Scenario& scenario) {
  TargetRecorder record(sensor.camera, sensor.target, sensor.rest, kKeyframes);
  const std::unique_ptr<ShotSource> source = held_shots(scenario, pushed_about(), 1, kOtherNoise);
  for (Shot shot; source->next(shot);) {
    Frame frame;
    frame.image = shot.image();
    frame.sequence = shot.sequence;
    frame.capture_time = frame.latency_origin = shot.time;
    record.add(frame);
  }
  check_record(record, sensor.target, sensor.rest);
  const TargetEstimate estimate = adjust_target(record.at_rest(), record.keyframes());
  check_estimate(estimate, sensor.target, sensor.camera);

  SensorConfig found = sensor;
  found.target = calibrated_target(sensor.target, estimate);
  found.rest.camera_T_platform = midpoint_frame(estimate.camera_T_tag);
  found.rest.appearance = record.at_rest().image;
  return found;
}

}  // namespace tagwrench::bench
