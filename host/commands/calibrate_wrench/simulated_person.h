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
  void look_at(const WrenchGuide& guide) noexcept;

 private:
  sim::Bench& bench_;
  const WrenchPlan& plan_;
  Vector6 range_;
  int ask_ = 0;
  int mounting_ = 0;  ///< the bench begins with a standing sensor, as plans should
};

}  // namespace tagwrench
