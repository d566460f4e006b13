// Where sockets of one user live while he is logged in.
#pragma once

#include <string>

namespace tagwrench {

/// $XDG_RUNTIME_DIR/tagwrench (XDG Base Directory Specification 0.8), else /run/tagwrench for root
/// and /tmp/tagwrench-UID for others. Made if it is not there, for its owner alone. Throws
/// ConfigError: it cannot be made, or belongs to somebody else.
std::string runtime_folder();

}  // namespace tagwrench
