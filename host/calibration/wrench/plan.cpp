#include "host/calibration/wrench/plan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "host/core/algebra/decompositions.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/os/text_file.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

std::string axis_words(const Eigen::Vector3d& direction) {
  int axis = 0;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  if (largest < 0.98)
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
  return fmt::format("{}{}", direction[axis] < 0 ? '-' : '+', "xyz"[axis]);
}

std::string load_words(const WrenchPlan& plan, const PlanStep& step) {
  switch (step.kind) {
    case StepKind::rest: return "rest";
    case StepKind::mass:
      return fmt::format("{:g} g at {}", step.mass * 1e3, plan.point_of(step).name);
    case StepKind::push:
      return fmt::format("push {} along {}", plan.point_of(step).name, axis_words(step.direction));
    case StepKind::six_axis: return "moved by hand";
  }
  return {};
}

std::string task(const WrenchPlan& plan, const PlanStep& step) {
  switch (step.kind) {
    case StepKind::rest: return "nothing hangs or presses, hands off";
    case StepKind::mass:
      return fmt::format("hang {:g} g at {} and let it come to rest", step.mass * 1e3,
                         plan.point_of(step).name);
    case StepKind::push:
      return fmt::format(
          "push with the load cell on {} along {}, slowly up to {:g} N and back, for {:g} s",
          plan.point_of(step).name, axis_words(step.direction), step.force, step.seconds);
    case StepKind::six_axis:
      return fmt::format(
          "push, pull, tilt and twist the platform every way by hand, slowly, for {:g} s",
          step.seconds);
  }
  return {};
}

constexpr double kMilli = 1e-3;
constexpr std::uint64_t kMaxPlan_bytes = 4U << 20;
constexpr double kDegree = std::numbers::pi / 180;

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

/// A direction of any length but nothing.
Eigen::Vector3d direction(YamlReader& node, const std::string& key) {
  const Eigen::Vector3d v = vector3(node.numbers(key, 3));
  if (v.norm() < 1e-6) node.fail(key, "is no direction; give three numbers that are not all 0");
  return v.normalized();
}

std::vector<PlanPoint> read_points(YamlReader& root) {
  std::vector<PlanPoint> points;
  if (!root.has("points")) return points;
  for (YamlReader& node : root.children("points")) {
    PlanPoint point;
    point.name = node.text("name");
    for (const PlanPoint& other : points)
      if (other.name == point.name) node.fail("name", "another point is called so already");
    point.position = vector3(node.numbers("position_mm", 3)) * kMilli;
    if (point.position.norm() > 1)
      node.fail("position_mm", "lies more than a metre away; it is in mm from the tags' midpoint");
    if (node.has("sigma_mm")) point.sigma = node.within("sigma_mm", 0, 100) * kMilli;
    node.finish();
    points.push_back(point);
  }
  return points;
}

int read_point(YamlReader& node, const WrenchPlan& plan) {
  const std::string name = node.text("at");
  std::string known;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].name == name) return static_cast<int>(i);
    known += (i == 0 ? "" : ", ") + plan.points[i].name;
  }
  node.fail("at", fmt::format("'{}' is none of the points; these are: {}", name,
                              known.empty() ? "none" : known));
}

PlanStep read_step(YamlReader& node, const WrenchPlan& plan, int mounting) {
  const auto need = [&](ReferenceKind kind, const char* name) {
    if (plan.reference != kind)
      node.fail("do", fmt::format("belongs into a plan with `reference: {}`", name));
  };
  PlanStep step;
  step.mounting = step.visit = mounting;
  step.kind = static_cast<StepKind>(node.one_of("do", {"rest", "mass", "push", "move"}));
  step.say = node.text_or("say", "");
  switch (step.kind) {
    case StepKind::rest: break;
    case StepKind::mass:
      need(ReferenceKind::masses, "masses");
      step.mass = node.within("mass_g", 0.01, 1e5) * kMilli;
      step.point = read_point(node, plan);
      break;
    case StepKind::push:
      need(ReferenceKind::load_cell, "load_cell");
      step.point = read_point(node, plan);
      step.direction = direction(node, "along");
      step.force = node.within("up_to_n", 1e-3, 1e4);
      step.seconds = node.has("seconds") ? node.within("seconds", 2, 600) : 8;
      break;
    case StepKind::six_axis:
      need(ReferenceKind::six_axis, "six_axis");
      step.seconds = node.within("seconds", 5, 3600);
      break;
  }
  node.finish();
  return step;
}

void read_mounting(YamlReader& node, WrenchPlan& plan) {
  Mounting mounting;
  mounting.name = node.text("name");
  mounting.say = node.text("say");
  mounting.gravity = direction(node, "gravity");
  mounting.sigma = (node.has("sigma_deg") ? node.within("sigma_deg", 0, 45) : 1) * kDegree;
  const int index = static_cast<int>(plan.mountings.size());
  plan.mountings.push_back(mounting);
  const std::size_t first = plan.steps.size();
  for (YamlReader& step : node.children("steps"))
    plan.steps.push_back(read_step(step, plan, index));
  if (plan.steps[first].kind != StepKind::rest)
    node.fail("steps", "must begin with {do: rest}, the zero of the loads that follow");
  node.finish();
}

WrenchPlan read_plan(YamlReader root, const std::string& name) {
  WrenchPlan plan;
  plan.name = name;
  plan.about = root.text_or("about", "");
  plan.minutes = root.integer_or("minutes", 0, 1000, 0);
  plan.reference =
      static_cast<ReferenceKind>(root.one_of("reference", {"masses", "load_cell", "six_axis"}));
  if (root.has("gravity_m_s2")) plan.gravity = root.within("gravity_m_s2", 9.7, 9.9);
  if (root.has("mass_sigma_percent"))
    plan.mass_sigma = root.within("mass_sigma_percent", 0, 50) / 100;
  plan.cell_channel = root.integer_or("cell_channel", 0, 3, 0);
  plan.line_sigma =
      (root.has("line_sigma_deg") ? root.within("line_sigma_deg", 0, 45) : 1.5) * kDegree;
  plan.reference_origin = vector3(root.numbers_or("reference_origin_mm", {0, 0, 0})) * kMilli;
  const Eigen::Vector3d turn = vector3(root.numbers_or("reference_rotation_rad", {0, 0, 0}));
  if (turn.norm() > 0)
    plan.camera_R_reference = Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
  plan.reference_sign = root.integer_or("reference_sign", -1, 1, 1);
  if (plan.reference_sign == 0) root.fail("reference_sign", "must be 1 or -1");
  plan.points = read_points(root);
  for (YamlReader& node : root.children("mountings")) read_mounting(node, plan);
  if (std::all_of(plan.steps.begin(), plan.steps.end(),
                  [](const PlanStep& s) { return s.kind == StepKind::rest; }))
    root.fail("mountings", "there is no step with a load; add some");
  root.finish();
  return plan;
}

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
    if (std::abs(direction[i]) <= 0.4 * direction.cwiseAbs().maxCoeff()) continue;
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

std::string describe(const WrenchPlan& plan, int step) {
  const PlanStep& s = plan.step(step);
  return fmt::format("step {} ({}, {})", step + 1, load_words(plan, s), plan.mounting_of(s).name);
}

std::string instruction(const WrenchPlan& plan, int step, bool new_mounting) {
  const PlanStep& s = plan.step(step);
  std::string text = fmt::format("step {} of {}: ", step + 1, plan.steps.size());
  if (new_mounting) text += plan.mounting_of(s).say + "; then ";
  return text + (s.say.empty() ? task(plan, s) : s.say);
}

WrenchPlan parse_plan(const std::string& text, const std::string& name) {
  return read_plan(YamlReader::from_text(text, name), name);
}

std::string plan_text(const std::string& name_or_file) {
  std::string names;
  for (const ReadyPlan& plan : ready_plans()) {
    if (plan.name == name_or_file) return plan.text;
    names += (names.empty() ? "" : ", ") + plan.name;
  }
  try {
    return read_text(name_or_file, kMaxPlan_bytes);
  } catch (const ConfigError& e) {
    throw ConfigError("--plan {}: not a ready-made plan ({}); {}", name_or_file, names, e.what());
  }
}

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
  const Eigen::Vector3d F = observation.wrench.head<3>(), M = observation.wrench.tail<3>();
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
