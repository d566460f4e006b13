// `tagwrench board led`.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <initializer_list>

#include "host/board/loop.h"
#include "host/config_error.h"
#include "host/tell.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

[[noreturn]] void not_a_light(const BoardOptions& options) {
  std::string words;
  for (const std::string& word : options.light) words += (words.empty() ? "" : " ") + word;
  throw ConfigError(fmt::format(
      "board led '{}': not a light; use off, LEVEL% (0 to 100), strobe PERIOD_US WIDTH_US "
      "[PHASE_US] or pattern [BIT_US [SEED]]",
      words));
}

struct Light {
  link::Led led{};
  double phase_us = 0;  ///< of a strobe
};

Light light_of(const BoardOptions& options) {
  const std::vector<std::string>& words = options.light;
  const auto number = [&](std::size_t i, double least, double most) {
    double value = 0;
    const char* end = words[i].data() + words[i].size();
    const auto [stop, error] = std::from_chars(words[i].data(), end, value);
    if (error != std::errc() || stop != end || !(value >= least && value <= most))
      not_a_light(options);
    return value;
  };
  Light out;
  const std::size_t count = words.size();
  if (words[0] == "off" && count == 1) return out;
  if (words[0] == "strobe" && (count == 3 || count == 4)) {
    out.led.mode = link::LedMode::strobe;
    out.led.period_us = static_cast<std::uint32_t>(number(1, 1, 60e6));
    out.led.width_us = static_cast<std::uint16_t>(number(2, 1, 65535));
    if (count == 4) out.phase_us = number(3, -60e6, 60e6);
    return out;
  }
  if (words[0] == "pattern" && count <= 3) {
    out.led.mode = link::LedMode::pattern;
    out.led.period_us = static_cast<std::uint32_t>(count > 1 ? number(1, 1, 60e6) : 7000);
    out.led.pattern_seed = static_cast<std::uint16_t>(count > 2 ? number(2, 1, 32767) : 1);
    return out;
  }
  if (count != 1 || words[0].back() != '%') not_a_light(options);
  double percent = 0;
  const char* end = words[0].data() + words[0].size() - 1;
  const auto [stop, error] = std::from_chars(words[0].data(), end, percent);
  if (error != std::errc() || stop != end || !(percent >= 0 && percent <= 100))
    not_a_light(options);
  out.led.mode = link::LedMode::steady;
  out.led.level_permille = static_cast<std::uint16_t>(std::lround(percent * 10));
  return out;
}

/// The next host time at which a pulse is due, as board time.
std::uint32_t start_of(const Light& light, const link::ClockSync& clock) {
  const TimePoint soon = std::chrono::steady_clock::now() + milliseconds(100);
  const std::int64_t soon_ns = soon.time_since_epoch().count();
  const std::int64_t period_ns = std::int64_t{light.led.period_us} * 1000;
  const std::int64_t phase_ns = std::llround(light.phase_us * 1000);
  const std::int64_t past = ((soon_ns - phase_ns) % period_ns + period_ns) % period_ns;
  return clock.to_board(soon + Duration(period_ns - past));
}

}  // namespace

int board_led(const BoardOptions& options) {
  Light light = light_of(options);
  BoardLoop loop(options.port, session_options(options));
  if (!loop.settle()) return 0;
  if (light.led.period_us > 0) light.led.start_us = start_of(light, loop.session().clock());
  loop.session().set_led(light.led);
  loop.link().send();

  const bool stays = light.led.mode != link::LedMode::off;
  if (stays) tell("the light stays until Ctrl-C");
  const TimePoint begin = std::chrono::steady_clock::now();
  while (loop.turn(begin + (stays ? std::chrono::hours(24 * 365) : milliseconds(300)))) {
    if (loop.led_refused()) return 2;
    if (!stays && std::chrono::steady_clock::now() - begin > milliseconds(300)) return 0;
  }
  loop.session().set_led(link::Led{});
  loop.link().send();
  return 0;
}

}  // namespace tagwrench
