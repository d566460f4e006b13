// `tagwrench spnav`: the daemon of the spnav socket, by hand or as a service.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class SpnavCommand {
 public:
  explicit SpnavCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Serves until a signal, or until it is idle for too long; returns the exit status. Throws
  /// ConfigError if the socket cannot be had.
  int run() const;

 private:
  command_line::Command verb_;
  std::string socket_;
  std::vector<int> inherited_;  ///< the listening sockets: of programs, of the bridge
};

}  // namespace tagwrench
