// The ways to track that are compared, behind one interface. Each learns what it needs from the
// same 25 frames at rest and answers with the displacement from rest.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/sensor/sensor_config.h"
#include "tests/bench/tracker_clip.h"

namespace tagwrench::bench {

struct Reading {
  bool ok = false;
  Vector6 displacement = Vector6::Zero();  ///< m, rad; as Track::displacement
  Matrix6 covariance = Matrix6::Zero();    ///< zero where the method claims none
};

class Method {
 public:
  explicit Method(std::string name) : name_(std::move(name)) {}
  virtual ~Method() = default;
  Method(const Method&) = delete;
  Method& operator=(const Method&) = delete;

  virtual Reading track(const Shot& shot) = 0;
  const std::string& name() const { return name_; }

 private:
  std::string name_;
};

enum class Corners { unrefined, subpixel, apriltag };

/// OpenCV's ArUco detector with default parameters but for the corners; the pose of the first tag
/// alone by IPPE.
std::unique_ptr<Method> opencv_one_tag(std::string name, const SensorConfig& sensor, Corners);

/// The same detector; all tags as one rigid body by solvePnP (iterative, from the last pose).
/// The body's geometry is that of the mean corners at rest. A frame without all tags is lost.
std::unique_ptr<Method> opencv_all_tags(std::string name, const SensorConfig& sensor, Corners);

/// The same detector; every tag's pose by IPPE, and of their translations and Euler angles (roll,
/// pitch, yaw about the camera's x, y, z), counted from rest, the mean over the tags, as the paper
/// has it. The angles stand in the place of the rotation vector. A frame without all tags is lost.
std::unique_ptr<Method> opencv_mean_of_tags(std::string name, const SensorConfig& sensor, Corners);

/// libapriltag 3, one thread, default parameters but full resolution (quad_decimate 1); the mean of
/// the displacements that its own pose of each tag gives. A frame without all tags is lost.
std::unique_ptr<Method> libapriltag(std::string name, const SensorConfig& sensor);

/// This project's tracker.
std::unique_ptr<Method> tagwrench_tracker(std::string name, const SensorConfig& sensor);

}  // namespace tagwrench::bench
