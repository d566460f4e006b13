// Each test in a process of its own: what it does to signals stays there.
#include "host/core/os/termination.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <cstring>
#include <functional>
#include <thread>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"

namespace tagwrench {
namespace {

constexpr int kHolds = 7;

/// What waitpid() has to say of a process that does this.
int fate_of(const std::function<bool()>& holds) {
  const pid_t child = ::fork();
  if (child == 0) {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_DFL);
    ::_exit(holds() ? kHolds : 1);
  }
  int status = 0;
  uninterrupted([&] { return ::waitpid(child, &status, 0); });
  return status;
}

bool holds_in_a_process(const std::function<bool()>& holds) {
  const int status = fate_of(holds);
  return WIFEXITED(status) && WEXITSTATUS(status) == kHolds;
}

bool readable(int fd) {
  pollfd entry{fd, POLLIN, 0};
  return ::poll(&entry, 1, 0) == 1;
}

TEST(Termination, EachOfItsSignalsMakesTheDescriptorReadableForGood) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_TRUE(holds_in_a_process([number] {
      const UniqueFd fd = termination_fd();
      const bool before = readable(fd.get()) || termination_requested();
      ::raise(number);
      return !before && readable(fd.get()) && readable(fd.get()) && termination_requested();
    })) << ::strsignal(number);
  }
}

TEST(Termination, AllCallersShareOneEvent) {
  EXPECT_TRUE(holds_in_a_process([] {
    if (borrowed_termination_fd() != -1) return false;
    const UniqueFd first = termination_fd();
    const UniqueFd second = termination_fd();
    ::raise(SIGTERM);
    const UniqueFd late = termination_fd();
    return first.get() != second.get() && readable(first.get()) && readable(second.get()) &&
           readable(late.get()) && readable(borrowed_termination_fd());
  }));
}

TEST(Termination, WhatWasIgnoredAtTheStartStaysIgnoredButForSigterm) {
  EXPECT_TRUE(holds_in_a_process([] {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_IGN);
    const UniqueFd fd = termination_fd();
    ::raise(SIGINT);
    ::raise(SIGHUP);
    if (termination_requested() || readable(fd.get())) return false;
    ::raise(SIGTERM);
    return termination_requested() && readable(fd.get());
  }));
}

TEST(Termination, WhatWasBlockedAtTheStartArrives) {
  EXPECT_TRUE(holds_in_a_process([] {
    sigset_t all;
    sigfillset(&all);
    ::sigprocmask(SIG_SETMASK, &all, nullptr);
    ::raise(SIGTERM);
    const UniqueFd fd = termination_fd();
    return readable(fd.get());
  }));
}

TEST(Termination, AnyThreadMayTakeTheSignal) {
  EXPECT_TRUE(holds_in_a_process([] {
    const UniqueFd fd = termination_fd();
    std::thread([] { ::pthread_kill(::pthread_self(), SIGINT); }).join();
    return readable(fd.get());
  }));
}

TEST(Termination, EndsAWaitWithEintrAndRepeatsOtherCalls) {
  EXPECT_TRUE(holds_in_a_process([] {
    const UniqueFd fd = termination_fd();
    const pthread_t waiting = ::pthread_self();
    std::thread other([waiting] { ::pthread_kill(waiting, SIGTERM); });
    pollfd entry{fd.get(), POLLIN, 0};
    const bool woken = uninterrupted([&] { return ::poll(&entry, 1, 20'000); }) == 1;
    other.join();
    return woken;
  }));
}

TEST(Termination, WithoutADescriptorItSaysWhatToDo) {
  EXPECT_TRUE(holds_in_a_process([] {
    rlimit before{};
    ::getrlimit(RLIMIT_NOFILE, &before);
    const rlimit none{0, before.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &none);
    try {
      const UniqueFd fd = termination_fd();
    } catch (const ConfigError& error) {
      ::setrlimit(RLIMIT_NOFILE, &before);  // a sanitizer's look at the object wants one, too
      return std::strstr(error.what(), "ulimit -n") != nullptr;
    }
    return false;
  }));
}

TEST(Termination, ForgottenItEndsTheProcessAgain) {
  const int status = fate_of([] {
    ::signal(SIGINT, SIG_IGN);
    const UniqueFd fd = termination_fd();
    forget_termination();
    ::raise(SIGINT);  // stays ignored
    ::raise(SIGTERM);
    return false;
  });
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
}

TEST(Termination, ADaemonIgnoresAllSignalsInAllThreads) {
  EXPECT_TRUE(holds_in_a_process([] {
    ignore_signals();
    for (int number = 1; number <= SIGRTMAX; ++number) {
      const bool fault = number == SIGABRT || number == SIGBUS || number == SIGFPE ||
                         number == SIGILL || number == SIGSEGV || number == SIGSYS ||
                         number == SIGTRAP;
      if (fault || number == SIGKILL || number == SIGSTOP) continue;
      std::thread([number] { ::pthread_kill(::pthread_self(), number); }).join();
    }
    return true;
  }));
}

}  // namespace
}  // namespace tagwrench
