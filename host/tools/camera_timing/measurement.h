// Room tools/camera_timing: what a camera really does.
// In:  pictures of a light that flashes a known pattern, or of a screen that flips; their stamps.
// Out: frame rate (Hz), latency, jitter, read-out, exposure (s), stale and missing pictures, each
//      with its standard deviation. Formulas: docs/theory.md.
// Then: camera_timing.h (the model), camera_timing_fit.h, pattern_lamp.h, flip_patches.h.
//
// `tagwrench camera-timing` without its options: a camera, a lamp, and what is done with them.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/source/frame_source.h"
#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {

class PatternLamp;

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

// The measurement without a board, as in the published design: a patch on a screen, in view of the
// camera, that flips between black and white. It tells less than an LED: the screen's own latency
// is in every number.

class FlipPatch {
 public:
  FlipPatch() = default;
  FlipPatch(const FlipPatch&) = delete;
  FlipPatch& operator=(const FlipPatch&) = delete;
  virtual ~FlipPatch() = default;

  /// Begins to show it so from `when` on, or from as soon as it can.
  virtual void show(bool white, TimePoint when) = 0;
  /// From when it has shown what was ordered last, host clock; nothing: not known yet.
  virtual std::optional<TimePoint> shown() = 0;
  /// By how much shown() may be wrong.
  virtual Duration clock_error() const { return {}; }
  /// One line: why it shows nothing any more; empty: it does.
  virtual std::string ended() { return {}; }
};

struct ScreenOptions {
  double seconds = 20;
  std::function<bool()> stopped;  ///< whether to end early; may be empty
  int stop_fd = -1;               ///< readable when that may have changed
};

struct ScreenMeasurement {
  std::string refusal;    ///< one line: why there is no result
  Figure frame_rate;      ///< by the time stamps, Hz
  Figure latency;         ///< of screen and camera, from the flip to the stamp of a picture whose
                          ///< exposure's middle is then, s
  double round_trip = 0;  ///< mean time from a flip to the arrival of the picture that shows it, s
  int flips = 0;          ///< that were seen
  int missed = 0;         ///< not seen within 1.5 s
  double contrast = 0;    ///< grey levels between black and white, mean of the picture
};

/// Flips at a random time after the picture that showed the flip before. The first picture to show
/// a flip comes latency to latency + one period later, evenly: latency is the mean less half a
/// period. A screen that flips with its refresh alone does so less evenly where that keeps step
/// with the camera; the widest gap that is left counts into the deviation.
ScreenMeasurement measure_screen(FrameSource& source, FlipPatch& patch,
                                 const ScreenOptions& options);

std::string report_text(const ScreenMeasurement& measurement, const std::string& camera,
                        const std::string& screen, double announced_period);
std::string report_json(const ScreenMeasurement& measurement, const std::string& camera,
                        const std::string& screen, double announced_period);

}  // namespace tagwrench
