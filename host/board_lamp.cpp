#include "host/board_lamp.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {

void BoardLamp::set_level(double permille) noexcept {
  link::Led led{};
  led.level_permille = static_cast<std::uint16_t>(std::lround(std::clamp(permille, 0.0, 1000.0)));
  led.mode = led.level_permille > 0 ? link::LedMode::steady : link::LedMode::off;
  link_.session().set_led(led);
  link_.send();
}

/// From two of its steps, so that a small change is one, up to what it may have for ever.
LightRange BoardLamp::range_permille() const noexcept {
  const link::Capabilities& can = link_.session().capabilities();
  const double most = std::clamp<double>(can.led_sustained_permille, 1, 1000);
  const double steps = std::max<double>(can.led_levels, 2);
  return {std::min(most, 2000.0 / steps), most};
}

}  // namespace tagwrench
