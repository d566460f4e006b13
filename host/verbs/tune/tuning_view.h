// What a tuner sees, as text.
#pragma once

#include <string>

#include "host/desk/live.h"
#include "host/verbs/tune/tuning.h"

namespace tagwrench {

/// At most `height` lines of at most `width` columns, joined by line ends that clear the rest of
/// the line; for the upper left corner of a screen. From 12 lines on the chosen knob is in it.
std::string tuning_view(const Tuning& tuning, const LiveReading& now, int width, int height);

}  // namespace tagwrench
