// `tagwrench board led`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/app/board/board_loop.h"
#include "host/commands/board/board.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/log.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

[[noreturn]] void not_a_light(const BoardOptions& options) {
  std::string words;
  for (const std::string& word : options.light) words += (words.empty() ? "" : " ") + word;
  throw ConfigError(
      "board led '{}': not a light; use off, LEVEL% (0 to 100), strobe PERIOD_US WIDTH_US "
      "[PHASE_US] or pattern [BIT_US [SEED]]",
      words);
}

struct Light {
  link::Led led{};
  double phase_us = 0;  ///< of a strobe
};

Light light_of(const BoardOptions& options) {
  const std::vector<std::string>& words = options.light;
  const auto number = [&](const std::string& text, double least, double most) {
    const std::optional<double> value = command_line::to_number(text);
    if (!value || !(*value >= least && *value <= most)) not_a_light(options);
    return *value;
  };
  Light out;
  const std::size_t count = words.size();
  if (words[0] == "off" && count == 1) return out;
  if (words[0] == "strobe" && (count == 3 || count == 4)) {
    out.led.mode = link::LedMode::strobe;
    out.led.period_us = static_cast<std::uint32_t>(number(words[1], 1, 60e6));
    out.led.width_us = static_cast<std::uint16_t>(number(words[2], 1, 65535));
    if (count == 4) out.phase_us = number(words[3], -60e6, 60e6);
    return out;
  }
  if (words[0] == "pattern" && count <= 3) {
    out.led.mode = link::LedMode::pattern;
    out.led.period_us = static_cast<std::uint32_t>(count > 1 ? number(words[1], 1, 60e6) : 7000);
    out.led.pattern_seed = static_cast<std::uint16_t>(count > 2 ? number(words[2], 1, 32767) : 1);
    return out;
  }
  if (count != 1 || words[0].back() != '%') not_a_light(options);
  const double percent = number(words[0].substr(0, words[0].size() - 1), 0, 100);
  out.led.mode = link::LedMode::steady;
  out.led.level_permille = static_cast<std::uint16_t>(std::lround(percent * 10));
  return out;
}

/// Throws ConfigError for pulses that this board cannot do.
void check_limits(const link::Led& led, const link::Capabilities& can) {
  if (led.period_us == 0 || can.strobe_period_max_us == 0) return;
  const auto check = [](const char* what, std::uint32_t value, std::uint32_t least,
                        std::uint32_t most, const std::string& condition = {}) {
    if (value < least || value > most)
      throw ConfigError("{} {} us: this board does {} to {} us{}", what, value, least, most,
                        condition);
  };
  const bool strobe = led.mode == link::LedMode::strobe;
  check(strobe ? "period" : "bit", led.period_us, can.strobe_period_min_us,
        can.strobe_period_max_us);
  if (!strobe) return;
  check("width", led.width_us, can.strobe_width_min_us, can.strobe_width_max_us);
  // Dark between two pulses for as long as a pulse lasts at least.
  const std::uint32_t dark = std::min<std::uint32_t>(can.strobe_width_min_us, led.period_us);
  check("width", led.width_us, can.strobe_width_min_us, led.period_us - dark,
        fmt::format(" with a period of {} us", led.period_us));
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
  if (loop.session().has_capabilities()) check_limits(light.led, loop.session().capabilities());
  if (light.led.period_us > 0) light.led.start_us = start_of(light, loop.session().clock());
  loop.session().set_led(light.led);
  loop.link().send();

  const bool stays = light.led.mode != link::LedMode::off;
  bool told = false;
  const TimePoint begin = std::chrono::steady_clock::now();
  while (loop.turn(begin + (stays ? std::chrono::hours(24 * 365) : milliseconds(300)))) {
    if (loop.led_refused()) return 2;
    if (!stays && std::chrono::steady_clock::now() - begin > milliseconds(300)) return 0;
    if (stays && !told && loop.session().led_accepted()) {
      told = true;
      log_info("the light stays until Ctrl-C");
    }
  }
  loop.session().set_led(link::Led{});
  loop.link().send();
  return 0;
}

}  // namespace tagwrench
