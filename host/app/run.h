// `tagwrench run` and `tagwrench record`: one run, or with pages one after the other as jobs want
// the camera and give it back.
#pragma once

#include "host/app/run_options.h"

namespace tagwrench {

/// Returns the exit status. Throws ConfigError if the run cannot start.
int run(const RunOptions& options);

}  // namespace tagwrench
