#include "host/calibration/wrench/load.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "host/core/algebra/decompositions.h"
#include "host/core/count_text.h"
#include "host/tracker/rotation.h"

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

Eigen::Vector3d moved_point(const Eigen::Vector3d& point, const Vector6& displacement) {
  return displacement.head<3>() + rotation_from_vector(displacement.tail<3>()) * point;
}

Matrix6 to_platform(const WrenchPlan& plan) {
  return plan.reference_sign * wrench_transform(plan.camera_R_reference, plan.reference_origin);
}

constexpr double kMinSigma = 0.003;  // of range: more than a good weight promises
constexpr std::array<const char*, 6> kActs{"pushes along x", "pushes along y", "pushes along z",
                                           "tilts about x",  "tilts about y",  "twists about z"};

/// Names the axes that make up a direction.
std::string complaint(const Vector6& direction) {
  std::vector<std::string> names;
  std::size_t last = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    if (std::abs(direction[static_cast<int>(i)]) <= 0.4 * direction.cwiseAbs().maxCoeff()) continue;
    names.emplace_back(kWrenchAxes[i]);
    last = i;
  }
  if (names.size() == 1) return fmt::format("no load {}: {}", kActs[last], names[0]);
  return fmt::format(
      "no loads tell {} from each other; they come in one proportion only: add a step at another "
      "point or along another line",
      listed(names));
}

}  // namespace

void set_hanging(const WrenchPlan& plan, int step, const Vector6& displacement,
                 Observation& observation) {
  const PlanStep& s = plan.step(step);
  const Mounting& mounting = plan.mounting_of(s);
  const PlanPoint& point = plan.point_of(s);
  set_line_load({.force = s.mass * plan.gravity,
                 .direction = mounting.gravity,
                 .point = moved_point(point.position, displacement),
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
  const PlanStep& s = plan.step(step);
  const PlanPoint& point = plan.point_of(s);
  set_line_load({.force = force.value,
                 .direction = s.direction,
                 .point = moved_point(point.position, displacement),
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
  const PlanStep& s = plan.step(step);
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

WrenchCoverage::WrenchCoverage(const Vector6& range)
    : range_(range), information_(Matrix6::Identity() / (kPrior * kPrior)) {}

Vector6 WrenchCoverage::scaled(const KnownLoad& load) const {
  return load.wrench.cwiseQuotient(range_);
}

double WrenchCoverage::relative_variance(const KnownLoad& load) const {
  const Vector6 variances = load.covariance.diagonal().cwiseQuotient(range_.cwiseAbs2());
  return variances.mean() + kMinSigma * kMinSigma;
}

void WrenchCoverage::add(const KnownLoad& load) {
  const Vector6 w = scaled(load);
  information_ += w * w.transpose() / relative_variance(load);
}

void WrenchCoverage::add_movement(const Matrix6& second_moment) {
  const Vector6 inverse = range_.cwiseInverse();
  information_ += inverse.asDiagonal() * second_moment * inverse.asDiagonal() /
                  (kMovementSigma * kMovementSigma);
}

Matrix6 WrenchCoverage::posterior() const { return inverse(information_); }

Vector6 WrenchCoverage::sigma() const { return posterior().diagonal().cwiseSqrt(); }

Vector6 WrenchCoverage::covered() const { return (1 - sigma().array() / kPrior).max(0).matrix(); }

std::vector<std::string> WrenchCoverage::missing() const {
  const EigenSystem<6> eigen = symmetric_eigen(information_);
  const auto open = static_cast<int>(
      (eigen.values.array() < 1 / (kCovered * kCovered)).count());  // they come first
  // Directions of equal information mix at will; the axes that lie among them wholly are named
  // alone.
  Eigen::Matrix<double, 6, Eigen::Dynamic> span = eigen.vectors.leftCols(open);
  std::vector<std::string> out;
  for (int axis = 0; axis < 6; ++axis) {
    if (span.row(axis).norm() < 0.9) continue;
    out.push_back(complaint(Vector6::Unit(axis)));
    span.row(axis).setZero();
  }
  const int rest = open - static_cast<int>(out.size());
  if (rest <= 0) return out;
  const Eigen::MatrixXd directions = left_singular_vectors(span);
  for (int i = 0; i < rest; ++i) out.push_back(complaint(directions.col(i)));
  return out;
}

double WrenchCoverage::gain(const KnownLoad& load) const {
  const Matrix6 P = posterior();
  const Vector6 w = scaled(load);
  const Vector6 Pw = P * w;
  return Pw.squaredNorm() / (relative_variance(load) + w.dot(Pw)) / P.trace();
}

void WrenchCoverage::add_expected(const WrenchPlan& plan, int step) {
  if (plan.step(step).kind == StepKind::six_axis)
    add_movement((0.25 * range_.cwiseAbs2()).asDiagonal());
  else
    add(expected_load(plan, step));
}

WrenchCoverage coverage_of(const WrenchPlan& plan, const Vector6& range) {
  WrenchCoverage coverage(range);
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    coverage.add_expected(plan, static_cast<int>(i));
  return coverage;
}

}  // namespace tagwrench
