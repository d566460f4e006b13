// Man pages from what the program says about its own verbs and options.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

// What the help text says that may follow an option, for man pages and completion.

/// "FILE", "INT", "{cad,game}": what the word is, in the words of the help text.
std::string value_name(const command_line::Option& option);

/// The words that may follow: the members of a set, or the first words of the indented lines of its
/// description. One that ends in a colon goes on, with a file say. Empty: there is no list.
std::vector<std::string> value_choices(const command_line::Option& option);

struct ManPage {
  std::string name;  ///< "tagwrench-board-flash"
  std::string text;  ///< man(7)
};

/// The page of `program` and one for each of its verbs and their verbs. `version` is shown at the
/// foot.
std::vector<ManPage> man_pages(const command_line::Command& program, const std::string& version);

}  // namespace tagwrench
