#include "host/calibration/wrench/load.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "host/wrench/known_load.h"

namespace tagwrench {
namespace {

// Of each hang and each push alone, standard deviations: where in its dimple the string or the tip
// sits (each coordinate), how a string that rubs or a hand leans (about each of two axes), what
// string and knot weigh.
constexpr double kContact = 0.1e-3;      // m
constexpr double kStringLean = 0.003;    // rad
constexpr double kHandLean = 0.004;      // rad
constexpr double kStringForce = 0.3e-3;  // N
// How well a six-axis reference's place is known, each coordinate and about each axis.
constexpr double kOriginSigma = 0.3e-3;  // m
constexpr double kTurnSigma = 0.003;     // rad

const PlanStep& at(const WrenchPlan& plan, int step) {
  return plan.steps[static_cast<std::size_t>(step)];
}

const PlanPoint& point_of(const WrenchPlan& plan, const PlanStep& step) {
  return plan.points[static_cast<std::size_t>(step.point)];
}

Eigen::Vector3d moved(const Eigen::Vector3d& point, const Vector6& displacement) {
  const Eigen::Vector3d r = displacement.tail<3>();
  const double angle = r.norm();
  const Eigen::Vector3d turned = angle > 0 ? Eigen::AngleAxisd(angle, r / angle) * point : point;
  return displacement.head<3>() + turned;
}

Matrix6 to_platform(const WrenchPlan& plan) {
  const Eigen::Matrix3d& R = plan.camera_R_reference;
  const Eigen::Vector3d& p = plan.reference_origin;
  Eigen::Matrix3d arm;
  arm << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  Matrix6 move = Matrix6::Zero();
  move.topLeftCorner<3, 3>() = R;
  move.bottomRightCorner<3, 3>() = R;
  move.bottomLeftCorner<3, 3>() = arm * R;
  return plan.reference_sign * move;
}

}  // namespace

void set_hanging(const WrenchPlan& plan, int step, const Vector6& displacement,
                 Observation& observation) {
  const PlanStep& s = at(plan, step);
  const Mounting& mounting = plan.mountings[static_cast<std::size_t>(s.mounting)];
  const PlanPoint& point = point_of(plan, s);
  set_line_load({.force = s.mass * plan.gravity,
                 .direction = mounting.gravity,
                 .point = moved(point.position, displacement),
                 .force_sigma = plan.mass_sigma,
                 .direction_sigma = mounting.sigma,
                 .point_sigma = point.sigma,
                 .force_name = fmt::format("mass {:g} g", s.mass * 1e3),
                 .direction_name = "gravity, " + mounting.name,
                 .point_name = "place of " + point.name,
                 .force_noise = kStringForce,
                 .direction_noise = kStringLean,
                 .point_noise = kContact},
                observation);
}

void set_push(const WrenchPlan& plan, int step, const CellForce& force, const Vector6& displacement,
              Observation& observation) {
  const PlanStep& s = at(plan, step);
  const PlanPoint& point = point_of(plan, s);
  set_line_load({.force = force.value,
                 .direction = s.direction,
                 .point = moved(point.position, displacement),
                 .force_sigma = force.gain_sigma,
                 .direction_sigma = plan.line_sigma,
                 .point_sigma = point.sigma,
                 .force_name = "scale of the load cell",
                 .direction_name = fmt::format("line of push {}", step + 1),
                 .point_name = "place of " + point.name,
                 .force_noise = force.noise,
                 .direction_noise = kHandLean,
                 .contact_sigma = kContact,
                 .contact_name = fmt::format("contact of push {}", step + 1)},
                observation);
  // A force that leans at a point that lies elsewhere: the torque e_k x w_i of either way w_i
  // across the line and an arm along each axis e_k, which sums up to I + u u^T. Microns times
  // milliradians are no unknowns of their own: as products of errors that a push shares, they made
  // the fit sure of how all lines are turned together.
  observation.products.clear();
  const double place = std::hypot(point.sigma, kContact);
  const double apart = std::hypot(kHandLean, plan.line_sigma) * place * force.value;
  observation.wrench_covariance.bottomRightCorner<3, 3>() +=
      apart * apart * (Eigen::Matrix3d::Identity() + s.direction * s.direction.transpose());
}

Vector6 six_axis_wrench(const WrenchPlan& plan, const Vector6& value) {
  return to_platform(plan) * value;
}

void set_six_axis(const WrenchPlan& plan, const Vector6& value, const Vector6& sigma,
                  Observation& observation) {
  const Matrix6 move = to_platform(plan);
  observation.wrench = move * value;
  observation.wrench_covariance = move * sigma.cwiseAbs2().asDiagonal() * move.transpose();
  observation.common.clear();
  const Eigen::Vector3d F = observation.wrench.head<3>();
  const Eigen::Vector3d M = observation.wrench.tail<3>();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(k);
    Vector6 shifted = Vector6::Zero();
    shifted.tail<3>() = kOriginSigma * e.cross(F);
    observation.common.push_back({fmt::format("place of the reference, {}", "xyz"[k]), shifted});
    Vector6 turned;
    turned << kTurnSigma * e.cross(F), kTurnSigma * e.cross(M);
    observation.common.push_back({fmt::format("turn of the reference about {}", "xyz"[k]), turned});
  }
}

KnownLoad expected_load(const WrenchPlan& plan, int step) {
  const PlanStep& s = at(plan, step);
  Observation observation;
  if (s.kind == StepKind::mass)
    set_hanging(plan, step, Vector6::Zero(), observation);
  else if (s.kind == StepKind::push)
    set_push(plan, step, {s.force, 0.01 * s.force, 0}, Vector6::Zero(), observation);
  else
    return {};
  KnownLoad load{observation.wrench, observation.wrench_covariance};
  for (const CorrelatedError& error : observation.common)
    load.covariance += error.effect * error.effect.transpose();
  return load;
}

}  // namespace tagwrench
