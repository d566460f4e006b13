#include "tests/firmware/led_log.h"

#include <algorithm>

namespace tagwrench::emulator {

void LedLog::set(VirtualTime time, double level) {
  if (level == changes_.back().level) return;
  if (time <= changes_.back().time) {
    changes_.back().level = level;
  } else {
    changes_.push_back({time, level});
  }
}

/// The last change at or before `time`; the first of all if there is none.
std::vector<LedChange>::const_iterator LedLog::last_until(VirtualTime time) const {
  const auto after =
      std::upper_bound(changes_.begin(), changes_.end(), time,
                       [](VirtualTime t, const LedChange& change) { return t < change.time; });
  return after == changes_.begin() ? after : after - 1;
}

double LedLog::level_at(VirtualTime time) const { return last_until(time)->level; }

double LedLog::mean(VirtualTime from, VirtualTime to) const {
  if (to <= from) return level_at(from);
  double sum = 0;
  VirtualTime at = from;
  for (auto change = last_until(from); change != changes_.end() && at < to; ++change) {
    const auto next = change + 1;
    const VirtualTime until = next == changes_.end() ? to : std::min(to, next->time);
    sum += change->level * static_cast<double>((until - at).count());
    at = until;
  }
  return sum / static_cast<double>((to - from).count());
}

std::vector<LedChange> LedLog::changes(VirtualTime from, VirtualTime to) const {
  std::vector<LedChange> within;
  for (const LedChange& change : changes_) {
    if (change.time >= from && change.time < to) within.push_back(change);
  }
  return within;
}

std::vector<LedPulse> LedLog::pulses(VirtualTime from, VirtualTime to) const {
  std::vector<LedPulse> found;
  bool lit = false;
  VirtualTime begin{};
  for (const LedChange& change : changes(from, to)) {
    if (change.level > 0 && !lit) {
      begin = change.time;
      lit = true;
    } else if (change.level == 0 && lit) {
      found.push_back({begin, change.time});
      lit = false;
    }
  }
  return found;
}

}  // namespace tagwrench::emulator
