// `tagwrench run`: see host/app/run.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/app/run.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

constexpr int kMaxRunFrames = 2'000'000'000;

/// Declares itself on the command line; must outlive the parsing.
class RunCommand {
 public:
  explicit RunCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  int run() const { return tagwrench::run(options_); }

 private:
  command_line::Command verb_;
  RunOptions options_;
};

}  // namespace tagwrench
