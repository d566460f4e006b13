#include "host/core/os/termination.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};
constexpr int kFaults[] = {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGSYS, SIGTRAP};

// A handler finds what it needs in static storage, without a lock.
std::atomic<int> event_fd{-1};
std::atomic<bool> requested{false};
static_assert(std::atomic<int>::is_always_lock_free);
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void note_termination(int) {
  const int error = errno;
  requested.store(true);
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(event_fd.load(), &one, sizeof one);
  errno = error;
}

bool is_ignored(int signal) noexcept {
  struct sigaction now {};
  return ::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

[[noreturn]] void no_descriptor() {
  throw ConfigError(std::string("no descriptor to be had for signals: ") + std::strerror(errno) +
                    "; raise the limit (ulimit -n), or end other programs");
}

int catch_signals() {
  const int event = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (event < 0) no_descriptor();
  event_fd.store(event);
  struct sigaction action {};
  action.sa_handler = note_termination;
  action.sa_flags = SA_RESTART;
  sigset_t caught;
  sigemptyset(&caught);
  for (const int signal : kSignals) {
    if (signal != SIGTERM && is_ignored(signal)) continue;
    ::sigaction(signal, &action, nullptr);
    sigaddset(&caught, signal);
  }
  ::pthread_sigmask(SIG_UNBLOCK, &caught, nullptr);
  return event;
}

}  // namespace

UniqueFd termination_fd() {
  static const int event = catch_signals();
  UniqueFd duplicate(::fcntl(event, F_DUPFD_CLOEXEC, 0));
  if (!duplicate) no_descriptor();
  return duplicate;
}

int borrowed_termination_fd() noexcept { return event_fd.load(); }

bool termination_requested() noexcept { return requested.load(); }

void forget_termination() noexcept {
  for (const int signal : kSignals)
    if (!is_ignored(signal)) ::signal(signal, SIG_DFL);
}

void ignore_signals() noexcept {
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    const bool fault =
        std::find(std::begin(kFaults), std::end(kFaults), signal) != std::end(kFaults);
    if (!fault && signal != SIGCHLD) ::signal(signal, SIG_IGN);  // refused for SIGKILL and SIGSTOP
  }
}

}  // namespace tagwrench
