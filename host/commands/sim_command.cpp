// `tagwrench sim`: pictures of the simulated sensor, in a folder.
#include <fmt/format.h>

#include "host/app/scenario_config.h"
#include "host/commands/commands.h"
#include "host/core/log.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {

void sim_command(command_line::Command program) {
  struct Options {
    std::string scenario;
    std::string folder;
    int frames = 0;
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "sim", "render the simulated sensor to a folder: frames, truth, sensor.yaml");
  verb.add_option("--scenario", o->scenario, "scenario YAML; without it the default scenario");
  verb.add_option("--out", o->folder, "folder to write").required();
  verb.add_option("--frames", o->frames, "number of frames")
      .required()
      .check(command_line::range(1, 10'000'000));
  verb.runs([o] {
    sim::export_folder(o->scenario.empty() ? sim::Scenario{} : load_scenario(o->scenario),
                       o->folder, o->frames);
    log_info("{} frames with truth and sensor.yaml in {}", o->frames, o->folder);
    return 0;
  });
}

}  // namespace tagwrench
