#include "host/calibration/wrench/plan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"

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
  std::error_code error;
  std::ifstream file;
  if (!std::filesystem::is_directory(name_or_file, error))
    file.open(name_or_file, std::ios::binary);
  std::ostringstream text;
  if (!file.is_open() || !(text << file.rdbuf())) {
    throw ConfigError("--plan {}: neither a ready-made plan ({}) nor a file that can be read",
                      name_or_file, names);
  }
  return text.str();
}

}  // namespace tagwrench
