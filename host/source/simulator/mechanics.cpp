#include "host/source/simulator/mechanics.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "host/core/algebra/decompositions.h"
#include "host/core/config_error.h"
#include "host/source/simulator/random.h"

namespace tagwrench::sim {
namespace {

constexpr int kMaxIterations = 30;
constexpr double kConverged = 1e-12;

// Distorted ray and its derivative by the undistorted one (OpenCV documentation, camera calibration
// and 3D reconstruction: x'' = x' (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x'y' + p2 (r^2 + 2 x'^2)).
Eigen::Vector2d distort(const std::array<double, 5>& k, const Eigen::Vector2d& ray,
                        Eigen::Matrix2d* derivative) {
  const double x = ray.x();
  const double y = ray.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = k[0] + r2 * (2 * k[1] + r2 * 3 * k[4]);  // of radial by r^2
  if (derivative != nullptr) {
    const double cross = 2 * x * y * slope + 2 * k[2] * x + 2 * k[3] * y;
    *derivative << radial + 2 * x * x * slope + 2 * k[2] * y + 6 * k[3] * x, cross, cross,
        radial + 2 * y * y * slope + 6 * k[2] * y + 2 * k[3] * x;
  }
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

constexpr double kMaxGap = 2.0;  // s

Matrix6 symmetric_function(const Matrix6& m, double (*f)(double)) {
  const EigenSystem<6> eigen = symmetric_eigen(m);
  const Vector6 values = eigen.values.unaryExpr(f);
  return eigen.vectors * values.asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

Eigen::Vector2d project(const Camera& camera, const Eigen::Vector2d& ray) noexcept {
  const Eigen::Vector2d bent = distort(camera.distortion, ray, nullptr);
  return {camera.fx_px * bent.x() + camera.cx_px, camera.fy_px * bent.y() + camera.cy_px};
}

bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector2d& ray) noexcept {
  const Eigen::Vector2d wanted((pixel.x() - camera.cx_px) / camera.fx_px,
                               (pixel.y() - camera.cy_px) / camera.fy_px);
  ray = wanted;
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Matrix2d derivative;
    const Eigen::Vector2d error = distort(camera.distortion, ray, &derivative) - wanted;
    // A lens whose image turns back on itself has no ray here.
    if (!(derivative.determinant() > 0.05)) return false;
    if (error.norm() < kConverged) return true;
    ray -= derivative.inverse() * error;
  }
  return false;
}

RayTable::RayTable(const Camera& camera) : stride_(camera.width_px + 2) {
  const std::size_t size =
      static_cast<std::size_t>(stride_) * static_cast<std::size_t>(camera.height_px + 2);
  x_.resize(size);
  y_.resize(size);
  std::size_t i = 0;
  for (int row = -1; row <= camera.height_px; ++row) {
    for (int column = -1; column <= camera.width_px; ++column, ++i) {
      Eigen::Vector2d ray;
      if (!unproject(camera, {column, row}, ray)) {
        throw ConfigError("scenario: camera.distortion folds the image over near pixel (" +
                          std::to_string(column) + ", " + std::to_string(row) +
                          "): use smaller coefficients");
      }
      x_[i] = static_cast<float>(ray.x());
      y_[i] = static_cast<float>(ray.y());
    }
  }
}

std::vector<PlacedTag> placed_tags(const Scenario& scenario) {
  const Target& target = scenario.target;
  Random random(scenario.seed, kPlacement);
  const auto error = [&random](double largest) {
    const double x = random.uniform(-largest, largest);
    const double y = random.uniform(-largest, largest);
    return Eigen::Vector3d(x, y, random.uniform(-largest, largest));
  };
  std::vector<PlacedTag> tags;
  Eigen::Vector3d midpoint = Eigen::Vector3d::Zero();
  for (const TagPlacement& nominal : target.tags) {
    PlacedTag tag{nominal.id, {}};
    tag.platform_T_tag.position = nominal.position + error(target.position_error);
    tag.platform_T_tag.rotation =
        rotation_matrix(error(target.rotation_error)) * rotation_matrix(nominal.rotation);
    midpoint += tag.platform_T_tag.position / static_cast<double>(target.tags.size());
    tags.push_back(tag);
  }
  for (PlacedTag& tag : tags) tag.platform_T_tag.position -= midpoint;
  return tags;
}

RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept {
  return {rotation_matrix(displacement.tail<3>()), target.rest_position + displacement.head<3>()};
}

Eigen::Matrix<double, 4, 3> spring_centres(const Mechanics& m) {
  const double x = m.spring_half_spacing_x;
  const double y = m.spring_half_spacing_y;
  // The base is on the camera's side.
  const double z = m.spring_attachment_z - 0.5 * m.spring_length;
  Eigen::Matrix<double, 4, 3> centres;
  centres << -x, -y, z, x, -y, z, -x, y, z, x, y, z;
  return centres;
}

Matrix6 stiffness(const Mechanics& m) {
  // Virtual work, column by column: the wrench that holds a unit displacement against all four
  // springs.
  const Eigen::Matrix<double, 4, 3> centres = spring_centres(m);
  const Eigen::Vector3d linear(m.lateral_stiffness, m.lateral_stiffness, m.axial_stiffness);
  const Eigen::Vector3d angular(m.bending_stiffness, m.bending_stiffness, m.torsion_stiffness);
  Matrix6 k = Matrix6::Zero();
  for (int column = 0; column < 6; ++column) {
    const Vector6 unit = Vector6::Unit(column);
    for (int spring = 0; spring < 4; ++spring) {
      const Eigen::Vector3d arm = centres.row(spring).transpose();
      const Eigen::Vector3d stretch = unit.head<3>() + unit.tail<3>().cross(arm);
      const Eigen::Vector3d force = linear.cwiseProduct(stretch);
      k.block<3, 1>(0, column) += force;
      k.block<3, 1>(3, column) += arm.cross(force) + angular.cwiseProduct(unit.tail<3>());
    }
  }
  return k;
}

Matrix6 inertia(const Mechanics& m) {
  const Eigen::Matrix3d c = cross_matrix(m.centre_of_mass);
  Matrix6 result;
  result.topLeftCorner<3, 3>() = m.mass * Eigen::Matrix3d::Identity();
  result.topRightCorner<3, 3>() = -m.mass * c;
  result.bottomLeftCorner<3, 3>() = m.mass * c;
  result.bottomRightCorner<3, 3>() = -m.mass * c * c;
  result.bottomRightCorner<3, 3>().diagonal() += m.principal_inertia;
  return result;
}

Matrix6 damping(const Mechanics& m) {
  // The same ratio for every mode: C = 2 zeta M^1/2 (M^-1/2 K M^-1/2)^1/2 M^1/2.
  const Matrix6 mass = inertia(m);
  const Matrix6 root = symmetric_function(mass, [](double x) { return std::sqrt(x); });
  const Matrix6 inverse_root =
      symmetric_function(mass, [](double x) { return 1.0 / std::sqrt(x); });
  const Matrix6 squared_frequencies = inverse_root * stiffness(m) * inverse_root;
  const Matrix6 frequencies =
      symmetric_function(squared_frequencies, [](double x) { return std::sqrt(std::max(x, 0.0)); });
  return 2 * m.damping_ratio * root * frequencies * root;
}

PlatformMotion::PlatformMotion(const Mechanics& mechanics, const TrajectoryPlayer& player,
                               double start_time, double memory, AppliedLoad* load)
    : mechanics_(mechanics),
      player_(player),
      applied_(load),
      stiffness_(stiffness(mechanics)),
      damping_(damping(mechanics)),
      inverse_inertia_(inverse(inertia(mechanics))),
      ring_(static_cast<std::size_t>(std::ceil(memory / kStep)) + 4),
      start_time_(start_time),
      load_(load_at(start_time, Vector6::Zero())),
      friction_reach_(mechanics.friction_travel *
                      Vector6::Map(mechanics.range.data()).cwiseQuotient(stiffness_.diagonal())) {
  friction_spring_ =
      mechanics.friction * Vector6::Map(mechanics.range.data()).cwiseQuotient(friction_reach_);
}

Vector6 PlatformMotion::load_at(double time, const Vector6& displacement) const noexcept {
  Vector6 load = applied_ ? applied_->wrench(time, displacement) : player_.applied_wrench(time);
  const Eigen::Vector3d inertial = mechanics_.mass * (applied_ ? applied_->gravity_change(time)
                                                               : -player_.base_acceleration(time));
  load.head<3>() += inertial;
  load.tail<3>() += mechanics_.centre_of_mass.cross(inertial);
  return load;
}

Vector6 PlatformMotion::acceleration(const State& state, const Vector6& load) const noexcept {
  Vector6 rest = load - damping_ * state.rate - stiffness_ * state.displacement;
  if (mechanics_.creep_share > 0) rest += stiffness_ * crept_;
  if (mechanics_.friction > 0) {
    const Vector6 stretch =
        (state.displacement - slider_).cwiseMin(friction_reach_).cwiseMax(-friction_reach_);
    rest -= friction_spring_.cwiseProduct(stretch);
  }
  return inverse_inertia_ * rest;
}

/// Creep goes on and sliders are dragged along, by one step.
void PlatformMotion::relax() noexcept {
  const Vector6& now = state_at(newest_).displacement;
  if (mechanics_.creep_share > 0)
    crept_ += kStep / mechanics_.creep_time * (mechanics_.creep_share * (now - crept_) - crept_);
  if (mechanics_.friction > 0)
    slider_ = slider_.cwiseMax(now - friction_reach_).cwiseMin(now + friction_reach_);
}

void PlatformMotion::step() noexcept {
  // Classical Runge-Kutta of fourth order.
  const double time = newest_time();
  const State& s = state_at(newest_);
  const Vector6 early = load_;
  const auto moved = [&s](const Vector6& rate, const Vector6& accel, double dt) {
    return State{s.displacement + dt * rate, s.rate + dt * accel};
  };
  const Vector6 v1 = s.rate;
  const Vector6 a1 = acceleration(s, early);
  const State s2 = moved(v1, a1, 0.5 * kStep);
  const Vector6 middle = load_at(time + 0.5 * kStep, s2.displacement);
  const Vector6 a2 = acceleration(s2, middle);
  const State s3 = moved(s2.rate, a2, 0.5 * kStep);
  const Vector6 a3 = acceleration(s3, middle);
  const State s4 = moved(s3.rate, a3, kStep);
  const Vector6 late = load_at(time + kStep, s4.displacement);
  const Vector6 a4 = acceleration(s4, late);
  const State next =
      moved((v1 + 2 * s2.rate + 2 * s3.rate + s4.rate) / 6, (a1 + 2 * a2 + 2 * a3 + a4) / 6, kStep);
  load_ = late;
  state_at(++newest_) = next;
  oldest_ = std::max(oldest_, newest_ - static_cast<long long>(ring_.size()) + 1);
  relax();
}

void PlatformMotion::restart(double time) noexcept {
  newest_ = static_cast<long long>((time - start_time_) / kStep);
  oldest_ = newest_;
  const double instant = newest_time();
  const Ldlt<6> springs(stiffness_);
  Vector6 displacement = springs.solve(load_at(instant, Vector6::Zero()));
  if (applied_) displacement = springs.solve(load_at(instant, displacement));
  load_ = load_at(instant, displacement);
  crept_ = mechanics_.creep_share * displacement;
  displacement += crept_;
  slider_ = displacement;
  state_at(newest_) = {displacement, Vector6::Zero()};
}

void PlatformMotion::advance_to(double time) noexcept {
  if (time - newest_time() > kMaxGap) restart(time - kMaxGap);
  while (newest_time() < time) step();
}

State PlatformMotion::at(double time) const noexcept {
  const double exact = (time - start_time_) / kStep;
  const auto position =
      std::clamp(exact, static_cast<double>(oldest_), static_cast<double>(newest_));
  const auto low = std::min(static_cast<long long>(position), std::max(newest_ - 1, oldest_));
  const State& a = ring_[static_cast<std::size_t>(low) % ring_.size()];
  const State& b = ring_[static_cast<std::size_t>(std::min(low + 1, newest_)) % ring_.size()];
  // Cubic Hermite: position and rate agree at both ends.
  const double u = position - static_cast<double>(low);
  const double u2 = u * u;
  const double u3 = u2 * u;
  return {(2 * u3 - 3 * u2 + 1) * a.displacement + (3 * u2 - 2 * u3) * b.displacement +
              kStep * ((u3 - 2 * u2 + u) * a.rate + (u3 - u2) * b.rate),
          (1 - u) * a.rate + u * b.rate};
}

Vector6 PlatformMotion::seen(double time) const noexcept {
  const Vector6 displacement = at(time).displacement;
  return applied_ ? Vector6(displacement + applied_->rest_change(time)) : displacement;
}

}  // namespace tagwrench::sim
