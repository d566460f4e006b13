#include "host/core/os/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>

#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

/// What a shell in a daemon's place writes to its descriptor 3.
std::string said_by(const std::string& script, DaemonSignals signals) {
  int ends[2];
  EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const UniqueFd read(ends[0]);
  UniqueFd write(ends[1]);
  const int inherited[] = {write.get()};
  pid_t pid = 0;
  EXPECT_EQ(spawn_daemon(pid, "/bin/sh", {"sh", "-c", script}, inherited, signals), 0);
  write.reset();
  std::string said;
  char bytes[512];
  for (ssize_t size; (size = ::read(read.get(), bytes, sizeof bytes)) > 0;)
    said.append(bytes, static_cast<std::size_t>(size));
  ::waitpid(pid, nullptr, 0);
  return said;
}

TEST(SpawnDaemon, HasItsDescriptorsAndNoOthersInASessionOfItsOwn) {
  const UniqueFd other(::open("/dev/null", O_RDONLY));  // not closed at exec
  const std::string session = std::to_string(::getsid(0));
  EXPECT_EQ(said_by("pwd >&3; for fd in /proc/$$/fd/*; do echo ${fd##*/}; done | sort -n | "
                    "tr '\\n' ' ' >&3; readlink /proc/$$/fd/0 /proc/$$/fd/1 /proc/$$/fd/2 >&3",
                    DaemonSignals::delivered)
                .substr(0, 10),
            "/\n0 1 2 3 ");
  EXPECT_NE(said_by("cut -d' ' -f6 /proc/$$/stat >&3", DaemonSignals::delivered), session + "\n");
}

TEST(SpawnDaemon, HasSignalsAsWanted) {
  // Not asked of the shell, which blocks SIGCHLD while it waits for a program.
  const std::string mask = "exec grep SigBlk /proc/self/status >&3";
  EXPECT_NE(said_by(mask, DaemonSignals::delivered).find("0000000000000000"), std::string::npos);
  EXPECT_NE(said_by(mask, DaemonSignals::blocked).find("fffffffe7ffbfeff"), std::string::npos);
}

TEST(SpawnDaemon, AProgramThatIsNotThereIsAnErrorNumber) {
  pid_t pid = 0;
  EXPECT_EQ(spawn_daemon(pid, "/no/such/program", {"x"}, {}, DaemonSignals::delivered), ENOENT);
}

}  // namespace
}  // namespace tagwrench
