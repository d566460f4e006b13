// The option by which a program that starts a verb asks for its events.
#pragma once

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// For programs, so no help mentions it.
inline void add_events_option(command_line::Command verb, int& descriptor) {
  verb.add_option("--events", descriptor).hidden().check(command_line::range(3, 1023));
}

}  // namespace tagwrench
