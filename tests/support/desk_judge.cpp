#include "tests/support/desk_judge.h"

#include <fmt/format.h>

#include <algorithm>

namespace tagwrench::test {
namespace {

using sim::DeskAct;
using sim::DeskDoing;

constexpr double kLate = 0.8;       // s
constexpr double kSettled = 1.0;    // s
constexpr double kSwingTime = 0.4;  // s, that the springs may need after a gesture

constexpr std::array<const char*, 10> kDoings = {
    "rest", "push",       "hand",       "brush",      "knock",
    "tap",  "double tap", "press-hold", "twist left", "twist right"};

std::size_t kind_of(DeskDoing doing) {
  return static_cast<std::size_t>(doing) - static_cast<std::size_t>(DeskDoing::tap);
}

Gesture meant(DeskDoing doing) {
  return static_cast<Gesture>(static_cast<std::size_t>(Gesture::tap) + kind_of(doing));
}

const char* words(DeskDoing doing) { return kDoings[static_cast<std::size_t>(doing)]; }

std::string describe(const DeskAct& act) {
  return fmt::format("{} {:.3f}..{:.3f} s, peak {:.2f} {:.2f} {:.2f} N {:.1f} {:.1f} {:.1f} mN m",
                     words(act.what), act.begin, act.end, act.peak[0], act.peak[1], act.peak[2],
                     1e3 * act.peak[3], 1e3 * act.peak[4], 1e3 * act.peak[5]);
}

}  // namespace

DeskJudge::DeskJudge(const sim::DeskUse& use)
    : use_(use), found_(use.acts().size()), held_(use.acts().size()) {}

void DeskJudge::add(double time, const GestureResult& felt, const Vector6& motion,
                    const Vector6& unheld) {
  const double dt = time - last_time_;
  last_time_ = time;
  const std::size_t position = use_.act_at(time);
  const DeskAct& act = use_.acts()[position];
  if (felt.recognised != Gesture::none) recognised(time, felt.recognised);
  if (felt.hold_motion) held_[position] += dt;
  if (is_gesture(act.what)) gesture_end_ = act.end;
  if (time < gesture_end_ + kSwingTime) {
    count_.swept += dt * motion.cwiseAbs().maxCoeff();
    count_.swept_unheld += dt * unheld.cwiseAbs().maxCoeff();
  }
  if (act.what != DeskDoing::rest) return;
  const double since = time - act.begin;
  const bool moves = !motion.isZero(0);
  if (since > kSettled) {
    ++count_.at_rest;
    count_.moving_at_rest += moves ? 1 : 0;
  }
  if (moves && since > count_.longest_motion) {
    count_.longest_motion = since;
    count_.longest_motion_at = act.begin;
  }
}

void DeskJudge::recognised(double time, Gesture gesture) {
  const std::vector<DeskAct>& acts = use_.acts();
  const std::size_t now = use_.act_at(time);
  for (std::size_t i = now + 1; i-- > 0 && time < acts[i].end + kLate;) {
    if (!is_gesture(acts[i].what) || meant(acts[i].what) != gesture || found_[i]) continue;
    found_[i] = true;
    DeskCount::Kind& kind = count_.kinds[kind_of(acts[i].what)];
    const double from = gesture == Gesture::press_hold ? acts[i].begin : acts[i].end;
    kind.latency_sum += time - from;
    kind.latency_most = std::max(kind.latency_most, time - from);
    ++kind.found;
    return;
  }
  ++count_.false_gestures;
  const DeskAct& before = acts[now > 0 && acts[now].what == DeskDoing::rest ? now - 1 : now];
  count_.mistakes.push_back(
      fmt::format("false {} at {:.3f} s: {}", name(gesture), time, describe(before)));
}

DeskCount DeskJudge::count(double time) const {
  DeskCount count = count_;
  for (std::size_t i = 0; i < use_.acts().size(); ++i) {
    const DeskAct& act = use_.acts()[i];
    if (act.end + kLate > time) break;
    if (act.what == DeskDoing::push) {
      ++count.pushes;
      count.pushes_held += held_[i] > 0 ? 1 : 0;
      count.held_sum += held_[i];
      count.held_most = std::max(count.held_most, held_[i]);
    }
    if (!is_gesture(act.what)) continue;
    ++count.kinds[kind_of(act.what)].made;
    if (found_[i]) continue;
    ++count.missed;
    count.mistakes.push_back("missed " + describe(act));
  }
  count.swept /= std::max(1, count.made());
  count.swept_unheld /= std::max(1, count.made());
  return count;
}

int DeskCount::made() const {
  int sum = 0;
  for (const Kind& kind : kinds) sum += kind.made;
  return sum;
}

std::string report(const DeskCount& count) {
  std::string text;
  for (std::size_t i = 0; i < count.kinds.size(); ++i) {
    const DeskCount::Kind& kind = count.kinds[i];
    text += fmt::format("{:<12} {:>3} of {:>3}, latency {:.0f} ms, at most {:.0f} ms\n",
                        words(static_cast<DeskDoing>(i + static_cast<std::size_t>(DeskDoing::tap))),
                        kind.found, kind.made, 1e3 * kind.latency_sum / std::max(1, kind.found),
                        1e3 * kind.latency_most);
  }
  text += fmt::format("{} false, {} missed\n", count.false_gestures, count.missed);
  text += fmt::format("{} pushes, {} held back: {:.1f} ms on average of all, at most {:.0f} ms\n",
                      count.pushes, count.pushes_held,
                      1e3 * count.held_sum / std::max(1, count.pushes), 1e3 * count.held_most);
  text += fmt::format("a gesture sweeps {:.1f} ms of full deflection, unheld {:.1f} ms\n",
                      1e3 * count.swept, 1e3 * count.swept_unheld);
  text += fmt::format(
      "{} samples at rest, {} of them moving; longest motion after a touch {:.0f} ms (at {:.1f} "
      "s)\n",
      count.at_rest, count.moving_at_rest, 1e3 * count.longest_motion, count.longest_motion_at);
  for (std::size_t i = 0; i < std::min<std::size_t>(12, count.mistakes.size()); ++i) {
    text += "  " + count.mistakes[i] + "\n";
  }
  return text;
}

}  // namespace tagwrench::test
