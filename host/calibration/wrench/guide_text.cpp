// What the guide says about how far it is.
#include <fmt/format.h>

#include <algorithm>

#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/load.h"

namespace tagwrench {

std::string coverage_bar(const WrenchCoverage& coverage) {
  constexpr int kLength = 5;
  const Vector6 covered = coverage.covered();
  std::string out;
  for (int i = 0; i < 6; ++i) {
    const int full = std::clamp(static_cast<int>(kLength * covered[i] + 0.5), 0, kLength);
    out += fmt::format("{}{} {}{}", i == 0 ? "" : " ", kWrenchAxes[static_cast<std::size_t>(i)],
                       std::string(static_cast<std::size_t>(full), '#'),
                       std::string(static_cast<std::size_t>(kLength - full), '.'));
  }
  return out;
}

/// What the plan would leave open if nothing else were skipped.
std::string WrenchGuide::still_missing() const {
  WrenchCoverage all = coverage_;
  for (const int s : todo_) {
    if (plan_.steps[static_cast<std::size_t>(s)].kind == StepKind::six_axis)
      all.add_movement((0.25 * options_.range.cwiseAbs2()).asDiagonal());
    else
      all.add(expected_load(plan_, s));
  }
  std::string out;
  for (const std::string& line : all.missing()) out += (out.empty() ? "" : "; ") + line;
  return out;
}

std::string WrenchGuide::most_useful() const {
  double best = 0;
  int which = -1;
  for (const int s : todo_) {
    const double gain = coverage_.gain(expected_load(plan_, s));
    if (gain > best) {
      best = gain;
      which = s;
    }
  }
  if (which < 0) return "";
  return fmt::format("; of the steps left, {} tells most ({:.0f} % of what is open)",
                     describe(plan_, which), 100 * best);
}

std::string WrenchGuide::waiting_for() const {
  if (hold_.frames().empty()) return "the tags are not seen";
  const Hold hold = hold_.look();
  const bool of_hold = step().kind == StepKind::rest || step().kind == StepKind::mass;
  if (!of_hold) {
    if (phase_ == Phase::taking)
      return fmt::format("{:.0f} s of {:.0f} s", now_ - begun_, step().seconds);
    return step().kind == StepKind::push && !let_go_ ? "take the cell off first"
                                                     : "begin when you are ready";
  }
  if (!complaint_.empty()) return complaint_;
  if (hold.unrest > 1)
    return fmt::format("not steady yet: {:.1f} times too much in {}", hold.unrest,
                       kWrenchAxes[static_cast<std::size_t>(hold.worst)]);
  if (!hold.full) return fmt::format("steady for {:.1f} s", hold.to - hold.from);
  return step().kind == StepKind::rest ? "nothing has moved yet" : "nothing hangs there yet";
}

std::string WrenchGuide::live() const {
  if (done()) return "done";
  return fmt::format("step {}/{}: {}  {}", todo_.front() + 1, plan_.steps.size(), waiting_for(),
                     coverage_bar(coverage_));
}

}  // namespace tagwrench
