#include "host/calibration/wrench/plan.h"

#include <fmt/format.h>

namespace tagwrench {
namespace {

std::string axis_words(const Eigen::Vector3d& direction) {
  int axis = 0;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  if (largest < 0.98)
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
  return fmt::format("{}{}", direction[axis] < 0 ? '-' : '+', "xyz"[axis]);
}

const std::string& point_name(const WrenchPlan& plan, const PlanStep& step) {
  return plan.points[static_cast<std::size_t>(step.point)].name;
}

const Mounting& mounting_of(const WrenchPlan& plan, const PlanStep& step) {
  return plan.mountings[static_cast<std::size_t>(step.mounting)];
}

std::string load_words(const WrenchPlan& plan, const PlanStep& step) {
  switch (step.kind) {
    case StepKind::rest:
      return "rest";
    case StepKind::mass:
      return fmt::format("{:g} g at {}", step.mass * 1e3, point_name(plan, step));
    case StepKind::push:
      return fmt::format("push {} along {}", point_name(plan, step), axis_words(step.direction));
    case StepKind::six_axis:
      return "moved by hand";
  }
  return {};
}

std::string task(const WrenchPlan& plan, const PlanStep& step) {
  switch (step.kind) {
    case StepKind::rest:
      return "nothing hangs or presses, hands off";
    case StepKind::mass:
      return fmt::format("hang {:g} g at {} and let it come to rest", step.mass * 1e3,
                         point_name(plan, step));
    case StepKind::push:
      return fmt::format(
          "push with the load cell on {} along {}, slowly up to {:g} N and back, for {:g} s",
          point_name(plan, step), axis_words(step.direction), step.force, step.seconds);
    case StepKind::six_axis:
      return fmt::format(
          "push, pull, tilt and twist the platform every way by hand, slowly, for {:g} s",
          step.seconds);
  }
  return {};
}

}  // namespace

std::string describe(const WrenchPlan& plan, int step) {
  const PlanStep& s = plan.steps[static_cast<std::size_t>(step)];
  return fmt::format("step {} ({}, {})", step + 1, load_words(plan, s), mounting_of(plan, s).name);
}

std::string instruction(const WrenchPlan& plan, int step, bool new_mounting) {
  const PlanStep& s = plan.steps[static_cast<std::size_t>(step)];
  std::string text = fmt::format("step {} of {}: ", step + 1, plan.steps.size());
  if (new_mounting) text += mounting_of(plan, s).say + "; then ";
  return text + (s.say.empty() ? task(plan, s) : s.say);
}

}  // namespace tagwrench
