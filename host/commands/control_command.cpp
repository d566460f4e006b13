// `tagwrench control`: a request to a sensor that runs.
#include "host/commands/commands.h"
#include "host/core/log.h"
#include "host/motion/control_socket.h"

namespace tagwrench {
namespace {

struct ControlOptions {
  std::string name = "sensor";
  std::string profile;
  std::string program;
};

/// 0: done; 1: the sensor refuses. Throws ConfigError if none runs.
int request(const std::string& name, const std::string& words) {
  const std::string answer = ask(control_path(name), words);
  constexpr std::string_view kDone = "ok: ";
  if (answer.starts_with(kDone)) {
    print_data(answer.substr(kDone.size()));
    return 0;
  }
  log_info(answer.substr(0, answer.find('\n')));
  return 1;
}

}  // namespace

void control_command(command_line::Command program) {
  const auto o = std::make_shared<ControlOptions>();
  auto verb = program.add_subcommand("control", "ask something of a sensor that runs");
  verb.require_subcommand();
  verb.add_option("--name", o->name, "of the sensor, as `tagwrench run --name` has it")
      .capture_default_str();
  verb.add_subcommand("zero", "what reads with hands off is nothing from now on").runs([o] {
    return request(o->name, "zero");
  });
  verb.add_subcommand("next", "the next of its profiles").runs([o] {
    return request(o->name, "next");
  });
  auto profile = verb.add_subcommand("profile", "the profile of this name");
  profile.add_option("profile", o->profile, "its name").required();
  profile.runs([o] { return request(o->name, "profile " + o->profile); });
  auto window = verb.add_subcommand(
      "window", "the program that has the focus, from a script of the desktop's");
  window.add_option("program", o->program, "its class or application id; without it: nobody knows");
  window.runs([o] { return request(o->name, "window " + o->program); });
  verb.add_subcommand("status", "which profiles it has, and the one in force").runs([o] {
    return request(o->name, "status");
  });
}

}  // namespace tagwrench
