// Where everything is: the lens, the tags as they were glued on, and the platform on its springs:
// M d'' + C d' + K d = applied wrench + inertial load, in displacement coordinates.
//
// The springs' law is linear in the displacement (translation and rotation vector), and wrenches
// are taken about the platform origin at rest; so in equilibrium the applied wrench is K d exactly,
// whatever the size of the motion. Creep and friction, where the scenario has them, add
//   K (d - c) in place of K d, with c' = (share (d - c) - c) / time, and
//   a spring to a slider on each axis, which is dragged along where that spring would pull more
//   than the friction holds.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::sim {

// Rotations and poses of the simulator, its own so that no error here can cancel one in the
// tracker.

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Rodrigues' formula: the rotation by |r| about r.
inline Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  const Eigen::Matrix3d cross = cross_matrix(r);
  const double a = angle < 1e-6 ? 1.0 : std::sin(angle) / angle;
  const double half_sine = angle < 1e-6 ? 0.5 * angle : std::sin(0.5 * angle);
  const double b = angle < 1e-6 ? 0.5 : 2.0 * half_sine * half_sine / (angle * angle);
  return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
}

struct RigidPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();

  RigidPose operator*(const RigidPose& inner) const {
    return {rotation * inner.rotation, rotation * inner.position + position};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + position;
  }
};

/// Where the ray (x/z, y/z) lands in the image, px.
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector2d& ray) noexcept;

/// The ray (x/z, y/z) that lands on a pixel: Newton's method on project(). False if it does not
/// converge, that is, if the distortion folds the image over.
bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector2d& ray) noexcept;

/// One ray per pixel, and one more pixel on each side so that rays between pixels follow from
/// neighbours.
class RayTable {
 public:
  /// Throws ConfigError if the distortion cannot be inverted all over the image.
  explicit RayTable(const Camera& camera);

  const float* x(int row) const noexcept { return x_.data() + offset(row); }
  const float* y(int row) const noexcept { return y_.data() + offset(row); }

 private:
  std::size_t offset(int row) const noexcept {
    return static_cast<std::size_t>(row + 1) * static_cast<std::size_t>(stride_) + 1;
  }

  int stride_;
  std::vector<float> x_, y_;
};

// Where the tags really sit after somebody has glued them on.

struct PlacedTag {
  int id = 0;
  RigidPose platform_T_tag;
};

/// Nominal placement plus seeded errors, shifted so that the midpoint of the tag centres is the
/// platform's origin.
std::vector<PlacedTag> placed_tags(const Scenario& scenario);

/// camera_T_platform at a displacement from rest: R_now = exp(r), since the platform's axes are the
/// camera's at rest.
RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept;

// The light of an LED outside of the simulation: of a board, real, emulated or played.

class LedLight {
 public:
  LedLight() = default;
  LedLight(const LedLight&) = delete;
  LedLight& operator=(const LedLight&) = delete;
  virtual ~LedLight() = default;

  /// Mean brightness, 0 (off) to 1 (on all the time), from `from` to `to` seconds of the source's
  /// simulation time; at an instant if they are equal. Asked row by row, in the order of time but
  /// for the overlap of the rows' exposures: an emulated board may be run up to `to` on the spot.
  virtual double mean(double from, double to) noexcept = 0;
};

/// One row each, platform frame, m.
Eigen::Matrix<double, 4, 3> spring_centres(const Mechanics& mechanics);
Matrix6 stiffness(const Mechanics& mechanics);
Matrix6 inertia(const Mechanics& mechanics);
Matrix6 damping(const Mechanics& mechanics);

/// Displacement and its rate: m, rad, m/s, rad/s.
struct State {
  Vector6 displacement = Vector6::Zero();
  Vector6 rate = Vector6::Zero();
};

/// Integrates with a fixed step and keeps the last `memory` seconds, so that a camera can look at
/// any instant of its exposure.
class PlatformMotion {
 public:
  static constexpr double kStep =
      2.0e-4;  ///< s; the stiffest mode (some 90 Hz) turns 0.1 rad in it

  /// `load`, borrowed, acts in place of the player's wrench, if there is one.
  PlatformMotion(const Mechanics& mechanics, const TrajectoryPlayer& player, double start_time,
                 double memory, AppliedLoad* load = nullptr);

  /// Integrates until `time` is inside the memory. After a gap of more than two seconds (a
  /// suspended machine) the platform restarts in equilibrium, so that the cost of one call is
  /// bounded.
  void advance_to(double time) noexcept;

  /// The state at a time within the memory; outside of it, at its nearest end.
  State at(double time) const noexcept;

  /// The displacement there as it looks from the camera: with what no load made.
  Vector6 seen(double time) const noexcept;
  /// What the user applies there.
  Vector6 applied_wrench(double time) const noexcept {
    return applied_ ? applied_->wrench(time, at(time).displacement) : player_.applied_wrench(time);
  }

  void set_state(const State& state) noexcept {
    oldest_ = newest_;
    state_at(newest_) = state;
  }
  const Matrix6& stiffness_matrix() const noexcept { return stiffness_; }

 private:
  Vector6 acceleration(const State& state, const Vector6& load) const noexcept;
  Vector6 load_at(double time, const Vector6& displacement) const noexcept;
  void relax() noexcept;
  void step() noexcept;
  void restart(double time) noexcept;
  double newest_time() const noexcept { return start_time_ + static_cast<double>(newest_) * kStep; }
  State& state_at(long long step) noexcept {
    return ring_[static_cast<std::size_t>(step) % ring_.size()];
  }

  Mechanics mechanics_;
  TrajectoryPlayer player_;
  AppliedLoad* applied_;
  Matrix6 stiffness_, damping_, inverse_inertia_;
  std::vector<State> ring_;
  long long newest_ = 0;  ///< step number; its state is ring_[newest_ % size]
  long long oldest_ = 0;
  double start_time_;
  Vector6 load_;                      ///< at the newest step
  Vector6 crept_ = Vector6::Zero();   ///< c
  Vector6 slider_ = Vector6::Zero();  ///< where it is held by friction
  Vector6 friction_spring_;           ///< N/m, N m/rad
  Vector6 friction_reach_;            ///< m, rad
};

}  // namespace tagwrench::sim
