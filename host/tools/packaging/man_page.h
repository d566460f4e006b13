// Man pages from what the program says about its own verbs and options.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

struct ManPage {
  std::string name;  ///< "tagwrench-board-flash"
  std::string text;  ///< man(7)
};

/// The page of `program` and one for each of its verbs and their verbs. `version` is shown at the
/// foot.
std::vector<ManPage> man_pages(const command_line::Command& program, const std::string& version);

}  // namespace tagwrench
