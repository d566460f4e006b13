// Man pages from what the program says about its own verbs and options.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tagwrench {

struct ManPage {
  std::string name;  ///< "tagwrench-board-flash"
  std::string text;  ///< man(7)
};

/// The page of `app` and one for each of its verbs and their verbs. `version` is shown at the foot.
std::vector<ManPage> man_pages(const CLI::App& app, const std::string& version);

}  // namespace tagwrench
