#include "host/core/os/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>

#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

/// What posix_spawn is told: what to do in the child before the program starts.
class SpawnPlan {
 public:
  SpawnPlan(std::span<const UniqueFd> descriptors, DaemonSignals signals) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, 0, "/dev/null", O_RDWR, 0);
    posix_spawn_file_actions_adddup2(&actions_, 0, 1);
    posix_spawn_file_actions_adddup2(&actions_, 0, 2);
    int number = kFirstDaemonFd;
    for (const UniqueFd& fd : descriptors)
      posix_spawn_file_actions_adddup2(&actions_, fd.get(), number++);
    posix_spawn_file_actions_addclosefrom_np(&actions_, number);
    posix_spawn_file_actions_addchdir_np(&actions_, "/");
    posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, signals == DaemonSignals::blocked ? &all : &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    posix_spawnattr_setflags(&attributes_,
                             POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }

  int spawn(pid_t& pid, const std::string& program, std::vector<char*>& argv) const {
    return ::posix_spawn(&pid, program.c_str(), &actions_, &attributes_, argv.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

void close_gap(unsigned first, unsigned last) noexcept {
  if (first > last || close_range(first, last, 0) == 0) return;
  rlimit files{};  // kernels before 5.9
  getrlimit(RLIMIT_NOFILE, &files);
  const rlim_t limit = std::min<rlim_t>(files.rlim_cur, 65536);
  for (unsigned fd = first; fd <= last && fd < limit; ++fd) ::close(static_cast<int>(fd));
}

}  // namespace

int spawn_daemon(pid_t& pid, const std::string& program, std::vector<std::string> words,
                 std::span<const int> descriptors, DaemonSignals signals) {
  // Duplicates that the rearrangement of low numbers leaves alone.
  const int above = kFirstDaemonFd + static_cast<int>(descriptors.size());
  std::vector<UniqueFd> high;
  for (const int fd : descriptors) {
    high.emplace_back(::fcntl(fd, F_DUPFD_CLOEXEC, above));
    if (!high.back()) return errno;
  }
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  return SpawnPlan(high, signals).spawn(pid, program, argv);
}

void close_all_but(const std::vector<int>& kept) noexcept {
  unsigned next = 0;
  for (const int fd : kept) {
    const auto number = static_cast<unsigned>(fd);
    if (number > next) close_gap(next, number - 1);
    next = std::max(next, number + 1);
  }
  close_gap(next, UINT_MAX);
}

}  // namespace tagwrench
