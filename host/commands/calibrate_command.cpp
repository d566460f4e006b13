// `tagwrench calibrate`: the verb above those that measure.
#include "host/commands/commands.h"

namespace tagwrench {

void calibrate_command(command_line::Command program) {
  auto verb =
      program.add_subcommand("calibrate", "measure this sensor and write it to its sensor.yaml");
  verb.require_subcommand();
  calibrate_camera_command(verb);
  calibrate_target_command(verb);
  calibrate_wrench_command(verb);
}

}  // namespace tagwrench
