// Room calibration/light: exposure, LED and gain, once, before a run.
// In:  what a picture shows of the tags' white, grey levels 0..255; what can be set.
// Out: exposure (us), LED (permille), gain to set next, until white is at 190 and nothing clips.
//
// LightControl is pure: it is told what a picture showed, and says what to set next.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/source/frame_source.h"
#include "host/tracker/acquire.h"

namespace tagwrench {

struct LightRange {
  double least = 0;
  double most = 0;  ///< equal to `least` where it cannot be set

  constexpr bool settable() const { return most > least; }
};

/// What camera and lamp can do. Light in the picture is proportional to the product of the three.
struct LightLimits {
  LightRange exposure_us;
  LightRange led_permille;  ///< `most` is what the LED may have for ever
  LightRange gain;
  double short_exposure_us = 4000;  ///< longer ones only when LED and gain are at their end
};

struct LightSetting {
  double exposure_us = 0, led_permille = 0, gain = 0;
};

struct LightReading {
  double white_counts = 0;      ///< grey level of the tags' white, 0..255
  double clipped_fraction = 0;  ///< of the tags' pixels, at the sensor's upper end, 0..1
};

/// Exposure first kept short (a moving target smears), then LED, then gain (it adds noise), and a
/// longer exposure last. Too much light is taken back in the reverse order, a short exposure
/// shortened last. Ambient light needs no model: every step starts from a picture.
class LightControl {
 public:
  enum class State : std::uint8_t {
    settling,
    settled,
    too_dark,    ///< everything is at its upper end
    too_bright,  ///< everything is at its lower end: ambient light
  };
  static constexpr double kTarget_counts = 190;    ///< of 255: noise and glare stay below the end
  static constexpr double kTolerance_counts = 12;  ///< that is settled
  static constexpr double kClipped_counts = 250;   ///< from here on the level is not known
  static constexpr double kMaxClippedFraction = 2e-3;  ///< of a picture that is not too bright

  /// Starts from a short exposure, the least gain and half of the LED.
  explicit LightControl(const LightLimits& limits) noexcept;

  /// To be set before the next picture.
  const LightSetting& setting() const noexcept { return setting_; }
  State state() const noexcept { return state_; }

  /// What a picture taken with setting() showed.
  State take(const LightReading& reading) noexcept;

 private:
  void scale(double factor) noexcept;

  LightLimits limits_;
  LightSetting setting_;
  State state_ = State::settling;
};

// How bright the tags are in a picture.

/// White is what one pixel in twenty of a tag exceeds, of the brightest tag; pixels count that lie
/// within a tag's corners. Where no tag was found, it is what one pixel in a hundred of the whole
/// picture exceeds, and nothing counts as clipped that is darker. `mirrored`: corners are of the
/// picture flipped left to right, as Acquirer::find() gives them for such a camera.
LightReading read_light(const ImageView& image, bool mirrored, const std::vector<FoundTag>& tags);

// Exposure, LED and gain set once, before anything is learned from the pictures; they stay fixed
// from then on.

/// The LED, as far as settling needs it.
class Lamp {
 public:
  virtual ~Lamp() = default;

  /// Mean level, 0 to 1000, from now on.
  virtual void set_level(double permille) noexcept = 0;
  /// What the LED may have for ever.
  virtual LightRange range_permille() const noexcept = 0;
  /// Readable when service() has something to do.
  virtual int poll_fd() const noexcept = 0;
  virtual void service() noexcept = 0;
};

struct LightReport {
  LightControl::State state = LightControl::State::settling;  ///< settling: it never became steady
  LightSetting setting;
  double white_counts = 0;      ///< of the tags, with this setting
  double ambient_fraction = 0;  ///< of that light, that is there when the LED is off, 0..1
  int tags_found = 0;
  bool stopped = false;  ///< by a signal, or the source ended
};

/// Sets the light, then looks once without the LED. Takes some dozens of frames.
LightReport settle_light(FrameSource& source, Acquirer& finder, bool mirrored, Lamp& lamp,
                         const UniqueFd& stop);

/// For people: what was set, and what to do if that is not good.
std::string light_text(const LightReport& report);

}  // namespace tagwrench
