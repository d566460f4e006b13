// Folders of one user (XDG Base Directory Specification 0.8).
#pragma once

#include <string>

namespace tagwrench {

/// Where what belongs to his sensors is kept: $XDG_CONFIG_HOME/tagwrench, else ~/.config/tagwrench;
/// empty if neither XDG_CONFIG_HOME nor HOME says where. It need not exist.
std::string config_folder();

/// Where sockets live while he is logged in: $XDG_RUNTIME_DIR/tagwrench, else /run/tagwrench for
/// root and /tmp/tagwrench-UID for others. Made if it is not there, for its owner alone. Throws
/// ConfigError: it cannot be made, or belongs to somebody else.
std::string runtime_folder();

}  // namespace tagwrench
