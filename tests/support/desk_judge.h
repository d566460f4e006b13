// What an input device made of an hour at the desk, against what the person meant.
//
// Found     A gesture that was told while it was made, or within 0.8 s of its end, as what it was.
// False     Any other that was told.
// Latency   From the finger's leaving to its telling; of a press-hold, from the finger's coming.
// At rest   From 1 s after the last touch (or knock) on; motion there is a count that should be 0.
// Held      What a push lost to the suspicion that it was a gesture.
// Swept     How far the view went on account of a gesture: time at full deflection.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "host/motion/gestures.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::test {

struct DeskCount {
  struct Kind {
    int made = 0;
    int found = 0;
    double latency_sum = 0;   ///< s
    double latency_most = 0;  ///< s
  };
  std::array<Kind, 5> kinds{};        ///< in the order of Gesture, from tap on
  std::vector<std::string> mistakes;  ///< false and missed ones, in words
  int false_gestures = 0;
  int missed = 0;
  int pushes = 0;
  int pushes_held = 0;
  double held_sum = 0;   ///< s
  double held_most = 0;  ///< s
  long at_rest = 0;      ///< samples
  long moving_at_rest = 0;
  double longest_motion = 0;     ///< s after a touch
  double longest_motion_at = 0;  ///< s, when that touch ended
  double swept = 0;              ///< s, mean of a gesture
  double swept_unheld = 0;       ///< s, if motion were not held back

  int made() const;
};

std::string report(const DeskCount& count);

class DeskJudge {
 public:
  explicit DeskJudge(const sim::DeskUse& use);

  /// Of every sample: s of simulation time, what was told, motion as the device has it, and what it
  /// were if nothing was held back.
  void add(double time, const GestureResult& felt, const Vector6& motion, const Vector6& unheld);
  /// Gestures that are over by `time` and were not told are missed.
  DeskCount count(double time) const;

 private:
  void recognised(double time, Gesture gesture);

  const sim::DeskUse& use_;
  std::vector<bool> found_;   ///< per act
  std::vector<double> held_;  ///< s, per act
  double last_time_ = 0;
  double gesture_end_ = -1;
  DeskCount count_;
};

}  // namespace tagwrench::test
