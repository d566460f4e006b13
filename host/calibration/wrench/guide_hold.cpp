// The guide at rests and masses: what is steady, and whether it is what the step asks for.
#include <fmt/format.h>

#include <cmath>

#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/load.h"

namespace tagwrench {
namespace {

using Line = GuideLine::Kind;

constexpr double kMoved = 0.02;  // of the range: more than this is somebody's doing
constexpr double kBump = 0.01;   // of the range: a rest may differ by so much from the one before
constexpr int kMaxBumps = 6;     // unattended
constexpr double kOwnWeight = 0.03;  // of the range: less does not tell how the sensor lies
constexpr double kTimeToAct = 8.0;   // s that a person has before it is said, or taken as done
// All loads count from the rests: what is steady must have become so before the second that is
// taken began, else the last of a push or of a swing is in it.
constexpr double kSettled = 0.5;  // s

/// Part of `felt` along `expected`, and the cosine between them.
struct Likeness {
  double ratio = 0;
  double cosine = 0;
};
Likeness likeness(const Vector6& felt, const Vector6& expected) {
  const double dot = felt.dot(expected);
  const double norms = felt.norm() * expected.norm();
  return {dot / expected.squaredNorm(), norms > 0 ? dot / norms : 0};
}

std::string axes_text(const Vector6& scaled) {
  std::string out;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(scaled[i]) > 0.3 * scaled.cwiseAbs().maxCoeff())
      out += fmt::format("{}{} {:+.0f} %", out.empty() ? "" : ", ",
                         kWrenchAxes[static_cast<std::size_t>(i)], 100 * scaled[i]);
  }
  return out;
}

std::string worst_text(const Vector6& scaled) {
  int axis = 0;
  const double worst = scaled.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{:.1f} % of full load in {}", 100 * worst,
                     kWrenchAxes[static_cast<std::size_t>(axis)]);
}

}  // namespace

/// Whether anything has happened to the platform since it was asked for.
bool WrenchGuide::has_moved(const Hold& hold) {
  const Vector6 way = hold_.scaled(hold_.frames().back().displacement - *asked_at_);
  moved_ = moved_ || way.cwiseAbs().maxCoeff() > kMoved || hold.unrest > 3;
  return moved_ || (repeated_ && now_ - *asked_time_ > kTimeToAct);  // it may be right as it hangs
}

void WrenchGuide::watch_hold() {
  const Hold hold = hold_.look();
  const bool of_cell = plan_.reference != ReferenceKind::masses;
  if (of_cell && !(last_reading_ && now_ - last_reading_->time < kMaxSilence)) {
    if (now_ - *asked_time_ > 2 * kMaxSilence) complain_of_silence();
    return;
  }
  const bool had_moved = moved_;
  const bool moved = has_moved(hold);
  if (moved_ && !had_moved) {  // what was steady until now is what was asked for before
    hold_.clear();
    steady_since_.reset();
    return;
  }
  if (!hold.steady) {
    steady_since_.reset();
    return;
  }
  if (!steady_since_) steady_since_ = now_;
  if (step().kind == StepKind::mass) {
    if (moved) watch_mass(hold);
    return;
  }
  // The first rest of a mounting comes after the sensor was turned, but for the very first one.
  const bool settled = now_ - *steady_since_ >= kSettled;
  if (settled && (last_rest() != nullptr || moved || asks_ == 1)) watch_rest(hold);
}

void WrenchGuide::watch_rest(const Hold& hold) {
  const StepRecord* before = last_rest();
  if (before == nullptr) {
    if (check_mounting(hold)) accept_hold();
    return;
  }
  const Vector6 by = hold_.scaled(hold.mean - mean_of(*before).displacement);
  const StepRecord& latest = records_.back();
  if (step_of(latest).kind == StepKind::mass) {
    const KnownLoad load = expected_load(plan_, latest.step);
    const Likeness mass = likeness(by, load.wrench.cwiseQuotient(options_.range));
    if (mass.cosine > 0.8 && mass.ratio > 0.3) {
      if (now_ - *asked_time_ < kTimeToAct) return;
      complain("the weight still hangs there; take it off", false);
      return;
    }
  }
  if (by.cwiseAbs().maxCoeff() > kBump)
    bumped(by);
  else
    accept_hold();
}

/// The platform's own weight tells how the sensor lies, once it is turned from how it lay first.
bool WrenchGuide::check_mounting(const Hold& hold) {
  if (records_.empty() || step_of(records_.front()).kind != StepKind::rest) return true;
  const auto gravity = [&](int mounting) {
    return plan_.mountings[static_cast<std::size_t>(mounting)].gravity;
  };
  const PlanStep& first = step_of(records_.front());
  Vector6 expected = Vector6::Zero();
  expected.head<3>() =
      (gravity(step().mounting) - gravity(first.mounting)).cwiseQuotient(options_.range.head<3>());
  Vector6 felt = hold_.scaled(hold.mean - mean_of(records_.front()).displacement);
  felt.tail<3>().setZero();
  if (expected.norm() < 1e-6 || felt.norm() < kOwnWeight) return true;
  if (likeness(felt, expected).cosine > 0.6) return true;
  complain(fmt::format("the platform's own weight pulls elsewhere than in this mounting ({}): the "
                       "sensor lies otherwise than the plan says",
                       axes_text(felt)),
           true);
  return false;
}

void WrenchGuide::watch_mass(const Hold& hold) {
  const StepRecord* rest = last_rest();
  if (rest == nullptr) {
    leave_out("there is no rest to count it from");
    return;
  }
  const Vector6 felt = hold_.scaled(hold.mean - mean_of(*rest).displacement);
  const Vector6 expected = expected_load(plan_, todo_.front()).wrench.cwiseQuotient(options_.range);
  const Likeness load = likeness(felt, expected);
  if (felt.norm() < 0.2 * expected.norm()) return;  // nothing hangs yet
  if (load.cosine < -0.5) {
    complain(
        fmt::format("it pulls the opposite way ({}): gravity or the point of the plan is other "
                    "than how it hangs",
                    axes_text(felt)),
        true);
  } else if (load.cosine < 0.6) {
    complain(fmt::format("it pulls elsewhere ({}) than the plan says ({}): gravity or the point of "
                         "the plan is other than how it hangs",
                         axes_text(felt), axes_text(expected)),
             true);
  } else if (load.ratio < 0.3 || load.ratio > 3) {
    complain(fmt::format("it pulls as {:.0f} g would: is it the weight that the plan says?",
                         1e3 * step().mass * load.ratio),
             true);
  } else {
    accept_hold();
  }
}

void WrenchGuide::accept_hold() {
  StepRecord record{todo_.front(), 0, hold_.frames(), {}};
  for (const ReferenceSample& sample : readings_) {
    if (sample.time >= record.frames.front().time && sample.time <= record.frames.back().time)
      record.readings.push_back(sample);
  }
  accept(std::move(record));
}

/// The rest is not where it was: what was measured since counts from nowhere.
void WrenchGuide::bumped(const Vector6& by) {
  std::vector<int> lost;
  const StepRecord* rest = last_rest();
  while (&records_.back() != rest) {
    lost.insert(lost.begin(), records_.back().step);
    records_.pop_back();
  }
  ++bumps_;
  const int here = todo_.front();
  std::string text =
      fmt::format("the rest is {} from where it was: the sensor was bumped, or a tag has slipped",
                  worst_text(by));
  if (options_.attempts > 0 && bumps_ > kMaxBumps) {
    failure_ = text + " again and again; fix it better";
    return;
  }
  if (!lost.empty()) {
    text += "; to be done again:";
    for (const int s : lost)
      text += fmt::format(" {}{}", describe(plan_, s), s == lost.back() ? "" : ",");
  }
  say(Line::warning, text);
  if (!lost.empty()) {
    std::vector<int> more = lost;
    more.push_back(here);
    todo_.insert(todo_.begin() + 1, more.begin(), more.end());
  }
  new_zero_ = true;
  accept_hold();
}

}  // namespace tagwrench
