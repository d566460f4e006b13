#include "host/calibration/wrench/plan_config.h"

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
    for (const PlanPoint& other : points) {
      if (other.name == point.name) node.fail("name", "another point is called so already");
    }
    for (int i = 0; i < 3; ++i)
      point.position[i] = node.numbers("position_mm", 3)[static_cast<std::size_t>(i)] * kMilli;
    if (point.position.norm() > 1)
      node.fail("position_mm", "lies more than a metre away; it is in mm from the tags' midpoint");
    point.sigma =
        node.has("sigma_mm") ? node.within("sigma_mm", 0, 100) * kMilli : PlanPoint{}.sigma;
    node.finish();
    points.push_back(point);
  }
  return points;
}

class StepReader {
 public:
  StepReader(const WrenchPlan& plan, int mounting, int visit)
      : plan_(plan), mounting_(mounting), visit_(visit) {}

  PlanStep read(YamlReader& node) const {
    PlanStep step;
    step.mounting = mounting_;
    step.visit = visit_;
    step.kind = static_cast<StepKind>(node.one_of("do", {"rest", "mass", "push", "move"}));
    step.say = node.text_or("say", "");
    switch (step.kind) {
      case StepKind::rest:
        break;
      case StepKind::mass:
        need(node, ReferenceKind::masses, "a plan with `reference: masses`");
        step.mass = node.within("mass_g", 0.01, 1e5) * kMilli;
        step.point = point(node);
        break;
      case StepKind::push:
        need(node, ReferenceKind::load_cell, "a plan with `reference: load_cell`");
        step.point = point(node);
        step.direction = direction(node, "along");
        step.force = node.within("up_to_n", 1e-3, 1e4);
        step.seconds = node.has("seconds") ? node.within("seconds", 2, 600) : 8;
        break;
      case StepKind::six_axis:
        need(node, ReferenceKind::six_axis, "a plan with `reference: six_axis`");
        step.seconds = node.within("seconds", 5, 3600);
        break;
    }
    node.finish();
    return step;
  }

 private:
  void need(YamlReader& node, ReferenceKind kind, const char* where) const {
    if (plan_.reference != kind) node.fail("do", fmt::format("belongs into {}", where));
  }
  int point(YamlReader& node) const {
    const std::string name = node.text("at");
    std::string known;
    for (std::size_t i = 0; i < plan_.points.size(); ++i) {
      if (plan_.points[i].name == name) return static_cast<int>(i);
      known += (i == 0 ? "" : ", ") + plan_.points[i].name;
    }
    node.fail("at", fmt::format("'{}' is none of the points; these are: {}", name,
                                known.empty() ? "none" : known));
  }

  const WrenchPlan& plan_;
  int mounting_;
  int visit_;
};

void read_mounting(YamlReader& node, WrenchPlan& plan) {
  Mounting mounting;
  mounting.name = node.text("name");
  mounting.say = node.text("say");
  mounting.gravity = direction(node, "gravity");
  mounting.sigma = (node.has("sigma_deg") ? node.within("sigma_deg", 0, 45) : 1) * kDegree;
  const int index = static_cast<int>(plan.mountings.size());
  plan.mountings.push_back(mounting);
  const StepReader reader(plan, index, index);
  const std::size_t first = plan.steps.size();
  for (YamlReader& step : node.children("steps")) plan.steps.push_back(reader.read(step));
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
    throw ConfigError(
        fmt::format("--plan {}: neither a ready-made plan ({}) nor a file that can be read",
                    name_or_file, names));
  }
  return text.str();
}

}  // namespace tagwrench
