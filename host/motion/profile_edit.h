// What has changed of a profile, written into its text.
#pragma once

#include <string>

#include "host/motion/profile_config.h"

namespace tagwrench {

/// The text of `before` with what differs in `after` written into it: comments and all else stay.
/// Throws ConfigError, naming `file`, if the text is no YAML mapping.
std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after);

}  // namespace tagwrench
