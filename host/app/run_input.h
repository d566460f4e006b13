// Where the frames of `tagwrench run` come from.
#pragma once

#include <functional>
#include <optional>

#include "host/app/input.h"
#include "host/app/run.h"
#include "host/output/watchdog.h"

namespace tagwrench {

/// The sensor of this profiles, where none is named: the configuration folder's, if it is there.
RunOptions with_own_sensor(RunOptions options);

/// The source that was asked for; without a request a camera that sees the tags, else the simulated
/// sensor, or with RunOptions::wait the first such camera to come. Nothing: a signal came while it
/// waited. `watch` may be null. Throws ConfigError.
std::optional<Input> open_run_input(const RunOptions& options, ServiceWatch* watch);

// For a service: the camera may come later than the program.

/// Calls `look` at once and whenever a camera node comes or changes its permissions, until it
/// returns an input; cameras that are there are not opened in between, so their lights stay off.
/// Nothing: a signal came first. `watch` may be null. Throws ConfigError if /dev cannot be watched.
std::optional<Input> wait_for_camera(const std::function<std::optional<Input>()>& look,
                                     ServiceWatch* watch);

}  // namespace tagwrench
