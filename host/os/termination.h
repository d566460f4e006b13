// Ctrl-C, kill and a closed terminal (SIGINT, SIGTERM, SIGHUP) as a descriptor for poll loops.
#pragma once

#include "host/os/unique_fd.h"

namespace tagwrench {

/// They no longer end the program at once; the descriptor is readable once one of them has come.
UniqueFd termination_fd();

/// Whether one of them has come.
bool termination_requested() noexcept;

}  // namespace tagwrench
