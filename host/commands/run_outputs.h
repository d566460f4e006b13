// Where the samples of `tagwrench run` go.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/app/input.h"
#include "host/commands/board/run_board.h"
#include "host/commands/run_command.h"
#include "host/output/output.h"
#include "host/output/spnav_output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

/// The outputs, and the devices among them that a watchdog must bring to rest.
struct Outputs {
  std::vector<std::unique_ptr<Output>> all;
  std::vector<WatchdogDevice> devices;
  const SpnavOutput* programs = nullptr;  ///< knows those that are connected
};

/// What goes on in the next run, if a job comes between: files that samples are written to, and
/// what systemd is told.
using KeptOutputs = std::vector<std::unique_ptr<Output>>;

/// What is asked for. Throws ConfigError about what cannot be, before anything is made or
/// overwritten.
std::vector<Spec> output_specs(const RunOptions& options);

/// A virtual device of this computer.
bool is_hid_device(const Spec& spec);
/// Something that moves by what profiles say.
bool is_input_device(const Spec& spec);

/// Devices first, because they are what may be refused; files are only then overwritten. `board`
/// may be null. Throws ConfigError.
/// What is in `kept` is taken from there.
Outputs open_outputs(const RunOptions& options, const Input& input, RunBoard* board,
                     KeptOutputs& kept);

/// Moves those back there.
KeptOutputs keep_outputs(Outputs& outputs);

}  // namespace tagwrench
