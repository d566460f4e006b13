// A global shutter's picture has one brightness, which fits many times: nothing but all pictures
// together, and their stamps, tell latency, jitter and exposure.
#pragma once

#include <vector>

#include "host/tools/camera_timing/camera_timing.h"
#include "host/tools/camera_timing/light_signal.h"

namespace tagwrench {

struct GlobalShutter {
  Figure latency, jitter, exposure;  ///< s; less the uncertainty of the clocks
  std::vector<double> times;         ///< per picture, middle of the exposure, host clock, s
  std::vector<double> sigmas;        ///< s, of stamp and picture together
  std::vector<double> misses;        ///< least difference of brightness from the light at any time
                                     ///< near; 0 dark, 1 lit
  std::vector<double> chances;  ///< that the light stood still for the exposure's ends, at this
                                ///< brightness: a picture before it may have the same by chance
  std::vector<double> changes;  ///< of brightness since the picture before; 0 for the first
};

/// Greatest likelihood, each picture's time integrated out: its delay normal about the latency, its
/// brightness that of the light at that time, but for a few outliers (stale ones). `start` is where
/// to look: latency to half a bit, jitter and exposure to a factor of two.
GlobalShutter fit_global_shutter(const CameraTimingInput& input, const LightSignal& light,
                                 const GlobalShutter& start);

}  // namespace tagwrench
