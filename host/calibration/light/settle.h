// Exposure, LED and gain set once, before anything is learned from the pictures; they stay fixed
// from then on.
#pragma once

#include <string>

#include "host/calibration/light/control.h"
#include "host/core/os/unique_fd.h"
#include "host/source/frame_source.h"

namespace tagwrench {

/// The LED, as far as settling needs it.
class Lamp {
 public:
  Lamp() = default;
  Lamp(const Lamp&) = delete;
  Lamp& operator=(const Lamp&) = delete;
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
