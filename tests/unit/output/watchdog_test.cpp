// Pipes stand in for the devices. A forked process is the bridge; the test ends it in all the ways
// it can end.
#include "host/output/watchdog.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/wait.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

namespace tagwrench {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kPatience_ms = 20000;  // only ever waited out when the code is wrong

struct Pipe {
  Pipe() {
    int ends[2];
    EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
    read.reset(ends[0]);
    write.reset(ends[1]);
  }
  UniqueFd read, write;
};

/// The next `count` characters; shorter at the end of the stream, "(silence)" if nothing comes.
std::string take(int fd, std::size_t count) {
  std::string text;
  while (text.size() < count) {
    pollfd waiting{fd, POLLIN, 0};
    if (poll(&waiting, 1, kPatience_ms) <= 0) return text + "(silence)";
    char c;
    if (read(fd, &c, 1) <= 0) break;
    text += c;
  }
  return text;
}

std::string take_all(int fd) { return take(fd, 1000); }

bool has_nothing(int fd) {
  pollfd waiting{fd, POLLIN, 0};
  return poll(&waiting, 1, 0) == 0;
}

WatchdogDevice device(const Pipe& pipe) { return {pipe.write.get(), {{'N'}}, {'D'}}; }

/// A bridge in a process of its own, that arms its watchdog and then does what it is told.
class Bridge {
 public:
  Bridge(Pipe& hid, const std::function<void(Watchdog&)>& run) {
    process_ = fork();
    if (process_ == 0) {
      Watchdog watchdog({device(hid)});
      const pid_t pid = watchdog.pid();
      if (::write(report_.write.get(), &pid, sizeof pid) < 0) _exit(1);
      run(watchdog);
      _exit(0);  // no destructors: as a crash leaves them
    }
    hid.write.reset();
    EXPECT_EQ(::read(report_.read.get(), &watchdog_, sizeof watchdog_),
              static_cast<ssize_t>(sizeof watchdog_));
  }
  ~Bridge() { kill(SIGKILL); }
  void kill(int signal) {
    if (process_ > 0) ::kill(process_, signal);
    if (signal == SIGKILL && process_ > 0) {
      waitpid(process_, nullptr, 0);
      process_ = 0;
    }
  }
  pid_t watchdog() const { return watchdog_; }

 private:
  Pipe report_;
  pid_t process_ = 0;
  pid_t watchdog_ = 0;
};

/// How often a process has gone to sleep; -1 while it runs.
long sleeps(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  bool asleep = false;
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("State:", 0) == 0) asleep = line.find('S', 6) != std::string::npos;
    if (line.rfind("voluntary_ctxt_switches:", 0) == 0)
      return asleep ? std::stol(line.substr(24)) : -1;
  }
  return -1;
}

/// Waits until the process has gone to sleep more often than `before`.
long asleep_again(pid_t process, long before) {
  long now = -1;
  while ((now = sleeps(process)) <= before) sched_yield();
  return now;
}

void wait_for_ever() {
  while (true) pause();
}

TEST(Watchdog, AMissedDeadlineIsNeutralOnceAndTheNextOneAgain) {
  Pipe hid;
  Watchdog watchdog({device(hid)});
  watchdog.expect_by(steady_clock::now() + milliseconds(1));
  EXPECT_EQ(take(hid.read.get(), 1), "N");
  // The far deadline wakes the watchdog, which would write again here if it did so more than once.
  watchdog.expect_by(steady_clock::now() + hours(1));
  watchdog.expect_by(steady_clock::now());
  EXPECT_EQ(take(hid.read.get(), 1), "N");
  EXPECT_TRUE(has_nothing(hid.read.get()));
}

TEST(Watchdog, EveryDeviceGoesNeutral) {
  Pipe a, b;
  Watchdog watchdog({device(a), {b.write.get(), {{'z', 'z'}}, {}}});
  watchdog.expect_by(steady_clock::now());
  EXPECT_EQ(take(a.read.get(), 1), "N");
  EXPECT_EQ(take(b.read.get(), 2), "zz");
}

TEST(Watchdog, ADeadlineThatIsPushedAheadIsKept) {
  Pipe hid;
  Watchdog watchdog({device(hid)});
  for (int i = 0; i < 1000; ++i) watchdog.expect_by(steady_clock::now() + hours(1));
  watchdog.stand_down();
  EXPECT_TRUE(has_nothing(hid.read.get()));
  watchdog.expect_by(steady_clock::now());  // it does listen
  EXPECT_EQ(take(hid.read.get(), 1), "N");
}

TEST(Watchdog, ADeadlineThatMovesBackCounts) {
  Pipe hid;
  Watchdog watchdog({device(hid)});
  const long before = asleep_again(watchdog.pid(), 0);
  watchdog.expect_by(steady_clock::now() + hours(1));
  asleep_again(watchdog.pid(), before);  // until the far deadline
  watchdog.expect_by(steady_clock::now() + milliseconds(1));
  EXPECT_EQ(take(hid.read.get(), 1), "N");
}

TEST(Watchdog, AnOrderlyEndLeavesTheDevicesToTheirOwners) {
  Pipe hid;
  pid_t pid = 0;
  {
    Watchdog watchdog({device(hid)});
    pid = watchdog.pid();
    watchdog.expect_by(steady_clock::now() + hours(1));
  }
  EXPECT_EQ(::kill(pid, 0), -1);  // waited for
  EXPECT_TRUE(has_nothing(hid.read.get()));
  hid.write.reset();
  EXPECT_EQ(take_all(hid.read.get()), "");
}

TEST(Watchdog, ABridgeKilledWhileStandingDownIsNeutralThenDestroyThenNobodyHoldsTheDevice) {
  Pipe hid;
  Bridge bridge(hid, [](Watchdog&) { wait_for_ever(); });
  bridge.kill(SIGKILL);
  EXPECT_EQ(take_all(hid.read.get()), "ND");  // and the end of the stream: the watchdog is gone
}

TEST(Watchdog, ABridgeKilledWhileRunningIsNeutralThenDestroy) {
  Pipe hid;
  Bridge bridge(hid, [](Watchdog& watchdog) {
    watchdog.expect_by(steady_clock::now() + hours(1));
    wait_for_ever();
  });
  bridge.kill(SIGKILL);
  EXPECT_EQ(take_all(hid.read.get()), "ND");
}

TEST(Watchdog, AStoppedBridgeIsNeutral) {
  Pipe hid, running;
  Bridge bridge(hid, [&](Watchdog& watchdog) {
    const char beat = 'b';
    while (true) {  // a loop that keeps its promise for as long as it is let
      watchdog.expect_by(steady_clock::now() + milliseconds(500));
      if (::write(running.write.get(), &beat, 1) < 0) _exit(1);
      poll(nullptr, 0, 5);
    }
  });
  EXPECT_EQ(take(running.read.get(), 3), "bbb");
  bridge.kill(SIGSTOP);
  EXPECT_EQ(take(hid.read.get(), 1), "N");
  bridge.kill(SIGKILL);
  EXPECT_EQ(take_all(hid.read.get()), "ND");
}

TEST(Watchdog, AHungLoopIsNeutral) {
  Pipe hid;
  Bridge bridge(hid, [](Watchdog& watchdog) {
    watchdog.expect_by(steady_clock::now() + milliseconds(1));
    wait_for_ever();
  });
  EXPECT_EQ(take(hid.read.get(), 1), "N");
}

TEST(Watchdog, SignalsOfTheTerminalDoNotReachTheWatchdog) {
  Pipe hid;
  Bridge bridge(hid, [](Watchdog&) { wait_for_ever(); });
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    EXPECT_EQ(::kill(bridge.watchdog(), signal), 0);
  }
  EXPECT_NE(getsid(bridge.watchdog()), getsid(0));
  bridge.kill(SIGKILL);
  EXPECT_EQ(take_all(hid.read.get()), "ND");
}

/// A process that libraries have filled with threads and fork handlers, as far as it must be
/// feared.
bool comes_up_beside_a_busy_library() {
  ::pthread_atfork(nullptr, nullptr, [] { _exit(3); });  // as if it waited for a lock for ever
  std::atomic<bool> over{false};
  std::thread library([&over] {
    for (std::size_t size = 1; !over; size = size % 100'000 + 997) std::free(std::malloc(size));
  });
  bool up = true;
  Pipe hid;
  for (int i = 0; i < 50 && up; ++i) {
    Watchdog watchdog({device(hid)});
    watchdog.expect_by(steady_clock::now());
    up = take(hid.read.get(), 1) == "N";
  }
  over = true;
  library.join();
  return up;
}

TEST(Watchdog, TheWatchdogComesUpWhateverLocksTheThreadsOfLibrariesHold) {
  const pid_t process = fork();
  if (process == 0) {
    ::alarm(60);
    _exit(comes_up_beside_a_busy_library() ? 7 : 1);
  }
  int status = 0;
  waitpid(process, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST(Watchdog, TheWatchdogHoldsTheDevicesAndNothingElse) {
  Pipe hid, camera;
  Bridge bridge(hid, [](Watchdog& watchdog) {
    watchdog.expect_by(steady_clock::now());
    wait_for_ever();
  });
  EXPECT_EQ(take(hid.read.get(), 1), "N");  // it is past its set-up
  int open = 0;
  for (int fd = 0; fd < 1024; ++fd) {
    const std::string link =
        "/proc/" + std::to_string(bridge.watchdog()) + "/fd/" + std::to_string(fd);
    char target[64];
    if (readlink(link.c_str(), target, sizeof target) > 0) ++open;
  }
  EXPECT_EQ(open, 2);  // the device and the link to the bridge
  std::ifstream comm("/proc/" + std::to_string(bridge.watchdog()) + "/comm");
  std::string name;
  std::getline(comm, name);
  EXPECT_EQ(name, "tw-watchdog");
}

TEST(Watchdog, WithoutDevicesThereIsNoWatchdog) {
  Watchdog watchdog({});
  watchdog.expect_by(steady_clock::now());
  watchdog.stand_down();
  EXPECT_EQ(watchdog.pid(), 0);
}

}  // namespace
}  // namespace tagwrench
