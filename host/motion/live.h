// What the sensor reads at this moment, as one line of text: for who watches while a profile is
// tuned.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "host/core/types.h"

namespace tagwrench {

struct LiveReading {
  Status status = Status::acquiring;
  Vector6 wrench = Vector6::Zero();  ///< N, N m
  Vector6 motion = Vector6::Zero();  ///< -1..1 per HID axis
  std::uint32_t buttons = 0;
  bool on_trial = false;  ///< of who asks: his profile is in force
};

/// "ok: STATUS, wrench, motion, buttons, 0 or 1", separated by blanks.
std::string live_text(const LiveReading& reading);
/// Nothing, if the text is none of live_text().
std::optional<LiveReading> parse_live(std::string_view text) noexcept;

}  // namespace tagwrench
