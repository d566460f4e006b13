// The table of commands. Exit status: 0 done, 1 failed while running, 2 wrong usage or a
// configuration that cannot be used.
#include <dlfcn.h>
#include <fcntl.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <string>

#include "host/commands/commands.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/log.h"

namespace tagwrench {
namespace {

constexpr int kFailed = 1;
constexpr int kUnusable = 2;

/// In the order of the help text.
constexpr void (*kCommands[])(command_line::Command program) = {
    // what runs and what it leaves
    run_command, sim_command, record_command, export_command, read_command,
    // setting up
    calibrate_command, tags_command, board_command,
    // how good it is
    analyze_command, camera_timing_command, check_command, zero_command, certificate_command,
    design_command,
    // at the desk
    control_command, spnav_command, gadget_command, doctor_command, manual_command};

template <typename Function>
Function* library_function(const char* name) noexcept {
  return reinterpret_cast<Function*>(::dlsym(RTLD_DEFAULT, name));
}

/// OpenBLAS, which apt may choose as OpenCV's LAPACK, starts a thread for every core beyond the
/// first when it is loaded, for sums that this program does not ask it for. Its variable of the
/// environment would have to be set before: libc forgets what a function of .preinit_array sets.
void end_blas_threads() noexcept {
  if (auto* set_threads = library_function<void(int)>("openblas_set_num_threads")) set_threads(1);
  if (auto* end_threads = library_function<int()>("blas_thread_shutdown_")) end_threads();
}

/// A closed standard stream would give its number to the next file that is opened, a device's say.
/// Standard output is not to be written to then: what was asked for would be lost without a word.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd) {
    const int how = fd == STDOUT_FILENO ? O_RDONLY : O_RDWR;
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", how) != fd) std::abort();
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
    program.require_subcommand();
    for (const auto declare : kCommands) declare(program);
    if (!program.parse(argc, argv)) return 0;
    return program.action()();
  } catch (const DamagedFile& e) {
    log_info(e.what());
    return kFailed;
  } catch (const ConfigError& e) {
    log_info(e.what());
    return kUnusable;
  } catch (const std::exception& e) {
    log_info(std::string("failed: ") + e.what());
    return kFailed;
  }
}
