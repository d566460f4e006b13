// Where the frames of `tagwrench run` come from.
#pragma once

#include <optional>

#include "host/app/input.h"
#include "host/app/run_options.h"
#include "host/output/service_watch.h"

namespace tagwrench {

/// The sensor of this profiles, where none is named: the configuration folder's, if it is there.
RunOptions with_own_sensor(RunOptions options);

/// The source that was asked for; without a request a camera that sees the tags, else the simulated
/// sensor, or with RunOptions::wait the first such camera to come. Nothing: a signal came while it
/// waited. `watch` may be null. Throws ConfigError.
std::optional<Input> open_run_input(const RunOptions& options, ServiceWatch* watch);

}  // namespace tagwrench
