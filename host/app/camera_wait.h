// For a service: the camera may come later than the program.
#pragma once

#include <functional>
#include <optional>

#include "host/app/input.h"
#include "host/output/service_watch.h"

namespace tagwrench {

/// Calls `look` at once and whenever a camera node comes or changes its permissions, until it
/// returns an input; cameras that are there are not opened in between, so their lights stay off.
/// Nothing: a signal came first. `watch` may be null. Throws ConfigError if /dev cannot be watched.
std::optional<Input> wait_for_camera(const std::function<std::optional<Input>()>& look,
                                     ServiceWatch* watch);

}  // namespace tagwrench
