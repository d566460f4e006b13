// What the help text says that may follow an option, for man pages and completion.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// "FILE", "INT", "{cad,game}": what the word is, in the words of the help text.
std::string value_name(const command_line::Option& option);

/// The words that may follow: the members of a set, or the first words of the indented lines of its
/// description. One that ends in a colon goes on, with a file say. Empty: there is no list.
std::vector<std::string> value_choices(const command_line::Option& option);

}  // namespace tagwrench
