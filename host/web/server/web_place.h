// Where pages are served, from what is said on the command line.
#pragma once

#include <filesystem>
#include <string>

#include "host/web/server/web_options.h"

namespace tagwrench {

/// `place`: "", "ADDRESS:PORT", an address with colons of its own in brackets. Throws ConfigError,
/// which begins with `option` ("--output web").
WebOptions parse_web(const std::string& option, const std::string& place);

/// Installed, or as they were built: beside the program.
std::filesystem::path built_pages();

}  // namespace tagwrench
