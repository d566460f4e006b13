// `tagwrench gadget`: this computer as a USB device of another one.
#pragma once

#include <string>

#include "host/core/command_line/command_line.h"
#include "host/output/gadget_kernel.h"
#include "host/output/gadget_output.h"
#include "host/output/gadget_tree.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class GadgetCommand {
 public:
  explicit GadgetCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError with what is missing.
  int run() const;

 private:
  void up() const;
  void down() const;
  void status() const;

  command_line::Command verb_;
  command_line::Command keep_;
  command_line::Command up_;
  command_line::Command down_;
  KernelPlaces places_;
  GadgetInheritance inherited_;  ///< of `keep`
  std::string name_ = "sensor";
  std::string face_ = "spacemouse";
  std::string id_;
  std::string udc_;
  bool self_powered_ = false;
};

}  // namespace tagwrench
