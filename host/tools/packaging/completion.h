// What may come next on the command line, for the completion of shells.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

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
