// Another program as a function: text in, text out. No shell.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

struct Program {
  std::string name;     ///< looked up in PATH
  std::string package;  ///< of Debian, for the message where it is missing
};

/// Its standard output, with `input` as its standard input. Throws ConfigError if it is not
/// installed; std::runtime_error, with the last line of its standard error, if it fails or does not
/// end in time (it is ended then).
std::string run_program(const Program& program, const std::vector<std::string>& arguments,
                        std::string_view input, std::chrono::seconds patience);

}  // namespace tagwrench
