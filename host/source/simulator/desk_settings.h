// How an hour at the desk goes (desk_use.h); used where trajectory.motion is `desk`.
#pragma once

namespace tagwrench::sim {

struct DeskSettings {
  double length = 3600;        ///< s, after the first rest; then nothing happens any more
  double gesture_share = 0.2;  ///< of what the person does
  double wander = 0.015;       ///< largest way of the zero, of the range
  double knock = 5.0;          ///< m/s^2, largest acceleration of the table; most are far smaller
};

}  // namespace tagwrench::sim
