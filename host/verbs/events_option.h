// The option by which a program that starts a verb asks for its events.
#pragma once

#include <CLI/CLI.hpp>

namespace tagwrench {

/// For programs, so no help mentions it.
inline void add_events_option(CLI::App& verb, int& descriptor) {
  verb.add_option("--events", descriptor)->group("")->check(CLI::Range(3, 1023));
}

}  // namespace tagwrench
