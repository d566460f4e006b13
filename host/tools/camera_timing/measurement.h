// Room tools/camera_timing: what a camera really does.
// In:  pictures of a light that flashes a known pattern, or of a screen that flips; their stamps.
// Out: frame rate (Hz), latency, jitter, read-out, exposure (s), stale and missing pictures, each
//      with its standard deviation. Formulas: docs/theory.md.
// Then: camera_timing.h (the model), camera_timing_fit.h, screen_measurement.h, pattern_lamp.h.
//
// `tagwrench camera-timing` without its options: a camera, a lamp, and what is done with them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/source/frame_source.h"
#include "host/tools/camera_timing/camera_timing.h"
#include "host/tools/camera_timing/pattern_lamp.h"
#include "host/tools/camera_timing/row_profile.h"

namespace tagwrench {

struct CameraTimingOptions {
  double seconds = 10;             ///< of pattern
  int reference_permille = 1000;   ///< level of the LED that a pattern's bits have
  double reference_seconds = 2.5;  ///< of steady light; the frames are handed to `process`
  /// Does with a frame what a run does, up to the last output.
  std::function<void(Frame&)> process;
  std::function<bool()> stopped;                ///< whether to end early; may be empty
  int stop_fd = -1;                             ///< readable when that may have changed
  std::function<void(const std::string&)> say;  ///< what is being done; may be empty
};

struct CameraTimingMeasurement {
  std::string refusal;  ///< one line: why there is no result
  bool failed =
      false;  ///< the refusal is a fault of the run (stopped, unplugged), not of the scene
  CameraTimingResult result;
  std::vector<double> processing;  ///< stamp to output of each processed frame, s, ascending
  double used_fraction = 0, saturated_fraction = 0,
         ambient_fraction = 0;  ///< of the picture; see RowProfiler
  double exposure_set_us = 0;   ///< that the camera was set to for it; 0: left alone
  double bit = 0;               ///< s
  double edge_sigma = 0;        ///< s, of the pattern on the host's clock
};

/// Takes reference pictures with the LED steady and off, then pictures of the pattern. On a virtual
/// clock as fast as it goes. The exposure is shortened if the LED alone makes the picture white,
/// and put back.
CameraTimingMeasurement measure_camera_timing(FrameSource& source, PatternLamp& lamp,
                                              const CameraTimingOptions& options);

// What `tagwrench camera-timing` says: for people, and as JSON.

struct CameraTimingSetting {
  std::string camera;           ///< one line about the source
  std::string lamp;             ///< one line about the lamp
  std::string output;           ///< where processed frames went: "wrench sensor"
  double announced_period = 0;  ///< s
};

/// Some twenty lines.
std::string report_text(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

/// One object; figures that the pictures cannot tell are null.
std::string report_json(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

}  // namespace tagwrench
