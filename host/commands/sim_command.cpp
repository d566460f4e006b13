#include "host/commands/sim_command.h"

#include <fmt/format.h>

#include "host/app/scenario_config.h"
#include "host/core/log.h"
#include "host/source/simulator/folder_export.h"

namespace tagwrench {

SimCommand::SimCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "sim", "render the simulated sensor to a folder: frames, truth, sensor.yaml")) {
  verb_.add_option("--scenario", scenario_, "scenario YAML; without it the default scenario");
  verb_.add_option("--out", folder_, "folder to write").required();
  verb_.add_option("--frames", frames_, "number of frames")
      .required()
      .check(command_line::range(1, 10'000'000));
}

int SimCommand::run() const {
  const sim::Scenario described = scenario_.empty() ? sim::Scenario{} : load_scenario(scenario_);
  sim::export_folder(described, folder_, frames_);
  log_info(fmt::format("{} frames with truth and sensor.yaml in {}", frames_, folder_));
  return 0;
}

}  // namespace tagwrench
