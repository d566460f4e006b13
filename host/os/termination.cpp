#include "host/os/termination.h"

#include <signal.h>
#include <sys/signalfd.h>

namespace tagwrench {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

}  // namespace

UniqueFd termination_fd() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kSignals) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, nullptr);  // they wait until the loop reads them
  return UniqueFd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
}

bool termination_requested() noexcept {
  sigset_t pending;
  if (sigpending(&pending) != 0) return false;
  for (const int signal : kSignals) {
    if (sigismember(&pending, signal) == 1) return true;
  }
  return false;
}

}  // namespace tagwrench
