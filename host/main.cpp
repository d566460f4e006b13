// The table of commands. Exit status: 0 done, 1 failed while running, 2 wrong usage or a
// configuration that cannot be used.
#include <fcntl.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "host/commands/analyze_command.h"
#include "host/commands/board/command.h"
#include "host/commands/calibrate_command.h"
#include "host/commands/camera_timing_command.h"
#include "host/commands/certificate_command.h"
#include "host/commands/check_command.h"
#include "host/commands/control_command.h"
#include "host/commands/design_command.h"
#include "host/commands/doctor_command.h"
#include "host/commands/export_command.h"
#include "host/commands/gadget_command.h"
#include "host/commands/manual_command.h"
#include "host/commands/read_command.h"
#include "host/commands/record_command.h"
#include "host/commands/run_command.h"
#include "host/commands/sim_command.h"
#include "host/commands/spnav_command.h"
#include "host/commands/tags_command.h"
#include "host/commands/zero_command.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/blas_threads.h"

namespace tagwrench {
namespace {

constexpr int kFailed = 1;
constexpr int kUnusable = 2;

struct Declared {
  std::function<bool()> parsed;
  std::function<int()> run;
};

template <typename Command>
Declared declare(command_line::Command program) {
  const auto command = std::make_shared<Command>(program);
  return {[command] { return command->parsed(); }, [command] { return command->run(); }};
}

/// In the order of the help text.
constexpr Declared (*kCommands[])(command_line::Command) = {
    // what runs and what it leaves
    declare<RunCommand>, declare<SimCommand>, declare<RecordCommand>, declare<ExportCommand>,
    declare<ReadCommand>,
    // setting up
    declare<CalibrateCommand>, declare<TagsCommand>, declare<BoardCommand>,
    // how good it is
    declare<AnalyzeCommand>, declare<CameraTimingCommand>, declare<CheckCommand>,
    declare<ZeroCommand>, declare<CertificateCommand>, declare<DesignCommand>,
    // at the desk
    declare<ControlCommand>, declare<SpnavCommand>, declare<GadgetCommand>, declare<DoctorCommand>,
    declare<ManualCommand>};

/// What does the command that was given; nothing: help was asked for.
std::function<int()> command_of(command_line::Program& program, int argc, char** argv) {
  program.require_subcommand();
  std::vector<Declared> commands;
  for (const auto declaration : kCommands) commands.push_back(declaration(program));
  if (!program.parse(argc, argv)) return {};
  for (const Declared& command : commands) {
    if (command.parsed()) return command.run;
  }
  return {};
}

/// A closed standard stream would give its number to the next file that is opened, a device's say.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd) {
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) != fd) std::abort();
  }
}

}  // namespace
}  // namespace tagwrench

int main(int argc, char** argv) {
  using namespace tagwrench;
  open_standard_streams();
  end_blas_threads();
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes becomes an error code
  std::signal(SIGPIPE, SIG_IGN);  // and so does a reader that has gone
  cv::setNumThreads(1);           // one thread, one poll loop
  try {
    command_line::Program program(
        "tagwrench: a camera under a spring platform as a 6-axis force-torque sensor and 6-DOF "
        "input device",
        TAGWRENCH_VERSION);
    const std::function<int()> command = command_of(program, argc, argv);
    return command ? command() : 0;
  } catch (const ConfigError& e) {
    log_info(e.what());
    return kUnusable;
  } catch (const std::exception& e) {
    log_info(std::string("failed: ") + e.what());
    return kFailed;
  }
}
