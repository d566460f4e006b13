// Every test of the firmware runs three times: from a clock that has just started, from one that
// wraps within seconds, and from one that wraps at once.
#pragma once

#include <algorithm>

#include "tests/unit/firmware/rig.h"

namespace tagwrench::firmware {

class Firmware : public Rig, public testing::WithParamInterface<std::uint32_t> {
 protected:
  Firmware() : Rig(GetParam()) {}

  /// Runs with a host that gives a sign of life every 0.1 s.
  void run_alive(std::uint32_t duration_us) {
    for (std::uint32_t t = 0; t < duration_us; t += 100000) {
      send(link::TimeRequest{});
      run(std::min<std::uint32_t>(100000, duration_us - t));
    }
  }
};

inline const auto kClockStarts = testing::Values(1000u, 0xFFF00000u, 0xFFFFF000u);

}  // namespace tagwrench::firmware
