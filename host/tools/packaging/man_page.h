// Man pages and the completion of shells, from what the program says about its own verbs and
// options.
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

// What may come next on the command line.

struct Completion {
  std::vector<std::string> words;  ///< whole ones that begin with what is typed
  bool files = false;              ///< names of files fit, too,
  std::string before_file;         ///< behind this, which is typed already: "recording:"
};

/// `typed`: the words behind the program's name, the last one up to the cursor, perhaps empty.
/// `profiles`: the ready ones.
Completion complete(const command_line::Command& program, const std::vector<std::string>& typed,
                    const std::vector<std::string>& profiles);

}  // namespace tagwrench
