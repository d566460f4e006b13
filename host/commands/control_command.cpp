#include "host/commands/control_command.h"

#include <cstdio>
#include <stdexcept>

#include "host/core/log.h"
#include "host/motion/control_socket.h"

namespace tagwrench {

ControlCommand::ControlCommand(command_line::Command program)
    : verb_(program.add_subcommand("control", "ask something of a sensor that runs")),
      zero_(verb_.add_subcommand("zero", "what reads with hands off is nothing from now on")),
      next_(verb_.add_subcommand("next", "the next of its profiles")),
      profile_(verb_.add_subcommand("profile", "the profile of this name")),
      window_(verb_.add_subcommand(
          "window", "the program that has the focus, from a script of the desktop's")) {
  verb_.require_subcommand();
  verb_.add_subcommand("status", "which profiles it has, and the one in force");
  verb_.add_option("--name", name_, "of the sensor, as `tagwrench run --name` has it")
      .capture_default_str();
  profile_.add_option("profile", profile_name_, "its name").required();
  window_.add_option("program", program_, "its class or application id; without it: nobody knows");
}

int ControlCommand::run() const {
  const std::string request = zero_.parsed()      ? "zero"
                              : next_.parsed()    ? "next"
                              : profile_.parsed() ? "profile " + profile_name_
                              : window_.parsed()  ? "window " + program_
                                                  : "status";
  const std::string answer = ask(control_path(name_), request);
  constexpr std::string_view kDone = "ok: ";
  if (answer.starts_with(kDone)) {
    if (std::fputs(answer.c_str() + kDone.size(), stdout) >= 0 && std::fflush(stdout) == 0)
      return 0;
    throw std::runtime_error("standard output: cannot be written; redirect it somewhere");
  }
  log_info(answer.substr(0, answer.find('\n')));
  return 1;
}

}  // namespace tagwrench
