// The name of a pseudo terminal: a symbolic link that one board has at a time.
#pragma once

#include <string>

namespace tagwrench {
namespace board {

/// Makes `name` a symbolic link to `terminal`, in place of one that a board left which is gone.
/// Whatever else has the name stays as it is. Returns what is wrong, in one line with the remedy;
/// nothing if it was done.
std::string take_name(const std::string& name, const std::string& terminal);

/// Removes the link if it still leads to `terminal`.
void leave_name(const std::string& name, const std::string& terminal);

}  // namespace board
}  // namespace tagwrench
