#include "tests/bench/hardware_loop.h"

#include <Eigen/Dense>

#include "host/sensor/sensor_config.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"
#include "tests/bench/tracker_bound.h"
#include "tests/bench/tracker_clip.h"

namespace tagwrench::bench {
namespace {

/// With this tag alone, at the platform's origin.
sim::Scenario of_one(sim::Scenario scenario, const sim::TagPlacement& tag,
                     const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned(rotation);
  scenario.target.tags = {{tag.id, Eigen::Vector3d::Zero(), turned.angle() * turned.axis()}};
  scenario.target.rest_position = position;
  return scenario;
}

}  // namespace

std::vector<HeldReadings> held_readings(const sim::Scenario& scenario,
                                        const std::vector<Vector6>& displacements,
                                        int frames_each) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  std::vector<HeldReadings> out(displacements.size());
  const auto source = held_shots(scenario, displacements, frames_each);
  for (Shot shot; source->next(shot);) {
    Frame frame;
    frame.image = shot.image();
    frame.sequence = shot.sequence;
    frame.capture_time = frame.latency_origin = shot.time;
    const Track track = tracker.track(frame);
    if (shot.phase != Phase::held) continue;
    auto& reading = out[static_cast<std::size_t>(shot.pose)].emplace_back();
    if (track.status == Status::ok) reading = HeldReading{track.displacement, track.covariance};
  }
  return out;
}

MirrorPair::MirrorPair(const sim::Scenario& scenario, const Eigen::Vector3d& normal,
                       double distance) {
  const Eigen::Vector3d origin = scenario.target.rest_position;
  const sim::TagPlacement& flat = scenario.target.tags[0];
  flat_ = {of_one(scenario, flat, origin + flat.position, sim::rotation_matrix(flat.rotation)),
           Eigen::Matrix3d::Identity(), flat.position};

  const sim::TagPlacement& sideways = scenario.target.tags[1];
  const Eigen::Matrix3d flip = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  const Eigen::Matrix3d turn =
      flip * (Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose());
  const Eigen::Vector3d at = turn * (origin + sideways.position) + 2 * distance * flip * normal;
  sim::Scenario flipped = scenario;
  flipped.seed += 1;
  flipped.camera.cx_px = scenario.camera.width_px - 1 - scenario.camera.cx_px;
  flipped.camera.distortion[3] *= -1;
  reflected_ = {of_one(flipped, sideways, at, turn * sim::rotation_matrix(sideways.rotation)), turn,
                sideways.position};
}

Vector6 MirrorPair::Half::seen(const Vector6& d) const {
  const Eigen::Vector3d r = d.tail<3>();
  const Eigen::Vector3d t = d.head<3>() + rotation_from_vector(r) * lever - lever;
  Vector6 out;
  out << turn * t, turn * r;
  return out;
}

Matrix6 MirrorPair::Half::derivative() const {
  Matrix6 out = Matrix6::Zero();
  out.topLeftCorner<3, 3>() = turn;
  out.topRightCorner<3, 3>() = -turn * cross_matrix(lever);
  out.bottomRightCorner<3, 3>() = turn;
  return out;
}

HeldReading MirrorPair::together(const Half& a, const HeldReading& by_a, const Half& b,
                                 const HeldReading& by_b) {
  const Matrix6 da = a.derivative(), db = b.derivative();
  const Matrix6 wa = da.transpose() * by_a.covariance.inverse();
  const Matrix6 wb = db.transpose() * by_b.covariance.inverse();
  HeldReading out;
  out.covariance = (wa * da + wb * db).inverse();
  constexpr int kSteps = 5;  // seen() is nearly linear
  for (int i = 0; i < kSteps; ++i) {
    out.displacement += out.covariance * (wa * (by_a.displacement - a.seen(out.displacement)) +
                                          wb * (by_b.displacement - b.seen(out.displacement)));
  }
  return out;
}

std::vector<HeldReadings> MirrorPair::held_readings(const std::vector<Vector6>& displacements,
                                                    int frames_each) const {
  const auto look = [&](const Half& half) {
    std::vector<Vector6> seen;
    for (const Vector6& d : displacements) seen.push_back(half.seen(d));
    return bench::held_readings(half.scenario, seen, frames_each);
  };
  const std::vector<HeldReadings> flat = look(flat_), reflected = look(reflected_);
  std::vector<HeldReadings> out(displacements.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t frame = 0; frame < flat[i].size(); ++frame) {
      const auto& a = flat[i][frame];
      const auto& b = reflected[i][frame];
      auto& both = out[i].emplace_back();
      if (a && b) both = together(flat_, *a, reflected_, *b);
    }
  }
  return out;
}

Matrix6 MirrorPair::bound() const {
  Matrix6 information = Matrix6::Zero();
  for (const Half* half : {&flat_, &reflected_}) {
    const Matrix6 one = BoundOfScenario(half->scenario).covariance(Vector6::Zero());
    information += half->derivative().transpose() * one.inverse() * half->derivative();
  }
  return information.inverse();
}

}  // namespace tagwrench::bench
