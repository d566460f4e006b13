// Where what belongs to one user's sensors is kept.
#pragma once

#include <string>

namespace tagwrench {

/// $XDG_CONFIG_HOME/tagwrench (XDG Base Directory Specification 0.8), else ~/.config/tagwrench;
/// empty if neither XDG_CONFIG_HOME nor HOME says where. It need not exist.
std::string config_folder();

}  // namespace tagwrench
