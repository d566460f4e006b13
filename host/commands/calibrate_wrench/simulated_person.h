// Does at the simulated bench what the guide asks for.
#pragma once

#include "host/calibration/wrench/guide.h"
#include "host/source/simulator/bench.h"

namespace tagwrench {

class SimulatedPerson {
 public:
  /// Borrows all. `range`: how far a movement by hand goes, N and N m.
  SimulatedPerson(sim::Bench& bench, const WrenchPlan& plan, const Vector6& range)
      : bench_(bench), plan_(plan), range_(range) {}

  /// With every frame: takes up what was asked for since the last one.
  void look_at(const WrenchGuide& guide) noexcept {
    constexpr double kHandShare = 0.6;  // of the range
    constexpr double kLonger = 1.6;     // than is asked for, in case it is not enough
    if (guide.done() || guide.asks() == ask_) return;
    ask_ = guide.asks();
    const PlanStep& step = plan_.steps[static_cast<std::size_t>(guide.asked())];
    const bool first = ask_ == 1;
    if (step.mounting != mounting_ || first) {
      mounting_ = step.mounting;
      const Eigen::Vector3d gravity = plan_.mountings[static_cast<std::size_t>(mounting_)].gravity;
      if (!first || gravity.z() > -0.999) bench_.turn(gravity);
    } else if (step.kind == StepKind::rest) {
      bench_.let_go();
    }
    const auto point = [&] { return plan_.points[static_cast<std::size_t>(step.point)].position; };
    if (step.kind == StepKind::mass) bench_.hang(step.mass, point());
    if (step.kind == StepKind::push) bench_.push(point(), step.direction, step.force, step.seconds);
    if (step.kind == StepKind::six_axis)
      bench_.move_about(kHandShare * range_, kLonger * step.seconds);
  }

 private:
  sim::Bench& bench_;
  const WrenchPlan& plan_;
  Vector6 range_;
  int ask_ = 0;
  int mounting_ = 0;  ///< the bench begins with a standing sensor, as plans should
};

}  // namespace tagwrench
