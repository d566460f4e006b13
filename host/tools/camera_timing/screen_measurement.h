// The measurement without a board, as in the published design: a patch on a screen, in view of the
// camera, that flips between black and white. It tells less than an LED: the screen's own latency
// is in every number.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "host/source/frame_source.h"
#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {

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
