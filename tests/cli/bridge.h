// Runs the tagwrench program as a user does: arguments in, exit status and both streams out.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "tests/support/temporary_folder.h"

extern char** environ;

namespace tagwrench::test {

struct Outcome {
  int status = -1;  ///< exit status, or 128 + signal
  std::string out;
  std::string err;
};

/// What a program is started with beside its arguments.
struct Surroundings {
  std::string input = "/dev/null";  ///< path of its standard input
  std::string error = "";           ///< path of its standard error; empty: it is read here
  std::vector<std::string> environment = {};  ///< NAME=VALUE, beside what this program has
  std::vector<int> ignored = {};              ///< signals, as in a shell's background job
  std::vector<int> blocked = {};              ///< signals
};

/// A running bridge; read its streams, signal it, wait for it. However this program was started, it
/// has the default actions of the signals that end programs, and none of them blocked.
class Bridge {
 public:
  /// `input` is the path of its standard input.
  explicit Bridge(const std::vector<std::string>& arguments, const std::string& input = "/dev/null",
                  const std::string& program = TAGWRENCH_PROGRAM)
      : Bridge(arguments, Surroundings{.input = input}, program) {}
  Bridge(const std::vector<std::string>& arguments, const Surroundings& surroundings,
         const std::string& program = TAGWRENCH_PROGRAM) {
    int out[2];
    int err[2];
    if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0)
      throw std::runtime_error("pipe");
    out_.reset(out[0]);
    err_.reset(err[0]);
    std::vector<std::string> all(1, program);
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& a : all) argv.push_back(a.data());
    argv.push_back(nullptr);
    std::vector<std::string> own = surroundings.environment;
    std::vector<char*> environment;  // the first of a name counts
    for (std::string& variable : own) environment.push_back(variable.data());
    for (char** variable = environ; *variable != nullptr; ++variable)
      environment.push_back(*variable);
    environment.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, surroundings.input.c_str(), O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    if (surroundings.error.empty())
      posix_spawn_file_actions_adddup2(&actions, err[1], 2);
    else
      posix_spawn_file_actions_addopen(&actions, 2, surroundings.error.c_str(), O_WRONLY, 0);
    sigset_t blocked = set_of(surroundings.blocked);
    sigset_t defaults = set_of({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
    for (const int number : surroundings.ignored) sigdelset(&defaults, number);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigmask(&attributes, &blocked);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::vector<std::pair<int, sighandler_t>> before;
    for (const int number : surroundings.ignored)
      before.emplace_back(number, std::signal(number, SIG_IGN));
    const int failed = ::posix_spawn(&pid_, program.c_str(), &actions, &attributes, argv.data(),
                                     environment.data());
    for (const auto& [number, action] : before) std::signal(number, action);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    ::close(out[1]);
    ::close(err[1]);
    if (failed != 0) throw std::runtime_error("cannot start " + program);
  }
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;
  ~Bridge() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }

  /// Waits until standard output holds `count` lines (true) or has ended (false).
  bool wait_for_lines(std::ptrdiff_t count) {
    while (std::count(outcome_.out.begin(), outcome_.out.end(), '\n') < count) {
      if (!pump()) return false;
    }
    return true;
  }
  /// Takes what is there, and says whether standard output holds `count` lines. Does not wait.
  bool has_lines(std::ptrdiff_t count) {
    pollfd waiting{out_.get(), POLLIN, 0};
    while (out_ && ::poll(&waiting, 1, 0) > 0) take(out_, outcome_.out);
    return std::count(outcome_.out.begin(), outcome_.out.end(), '\n') >= count;
  }
  /// wait_for_lines() for a text on standard error.
  bool wait_for_message(const std::string& text) {
    while (outcome_.err.find(text) == std::string::npos) {
      if (!pump()) return false;
    }
    return true;
  }
  const std::string& out() const { return outcome_.out; }
  const std::string& err() const { return outcome_.err; }
  void close_stdout() { out_.reset(); }
  void close_stderr() { err_.reset(); }
  void signal(int number) { ::kill(pid_, number); }
  pid_t pid() const { return pid_; }
  /// Its threads whose name this is; all, without a name.
  std::vector<pid_t> threads(const std::string& name = "") const {
    std::vector<pid_t> found;
    const std::filesystem::path tasks = "/proc/" + std::to_string(pid_) + "/task";
    for (const auto& task : std::filesystem::directory_iterator(tasks)) {
      std::string its;
      std::getline(std::ifstream(task.path() / "comm"), its);
      if (name.empty() || its == name) found.push_back(std::stoi(task.path().filename()));
    }
    return found;
  }
  void signal_thread(pid_t thread, int number) { ::tgkill(pid_, thread, number); }

  /// Reads a small pipe once every 150 ms, much longer than a frame may take, so that the program
  /// must wait.
  Outcome finish_slowly() {
    ::fcntl(out_.get(), F_SETPIPE_SZ, 4096);
    while (out_) {
      take(out_, outcome_.out);
      const timespec pause{0, 150'000'000};
      ::nanosleep(&pause, nullptr);
    }
    return finish();
  }

  Outcome finish() {
    while (pump()) {
    }
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    outcome_.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return outcome_;
  }

 private:
  static sigset_t set_of(const std::vector<int>& signals) {
    sigset_t set;
    sigemptyset(&set);
    for (const int number : signals) sigaddset(&set, number);
    return set;
  }
  /// Reads what is there; false when both streams have ended.
  bool pump() {
    pollfd fds[2] = {{out_.get(), POLLIN, 0}, {err_.get(), POLLIN, 0}};
    if (!out_ && !err_) return false;
    ::poll(fds, 2, -1);
    if (fds[0].revents != 0) take(out_, outcome_.out);
    if (fds[1].revents != 0) take(err_, outcome_.err);
    return true;
  }
  static void take(UniqueFd& fd, std::string& into) {
    char buffer[4096];
    const ssize_t n = ::read(fd.get(), buffer, sizeof buffer);
    if (n > 0) {
      into.append(buffer, static_cast<std::size_t>(n));
    } else {
      fd.reset();
    }
  }

  pid_t pid_ = -1;
  UniqueFd out_;
  UniqueFd err_;
  Outcome outcome_;
};

/// Waits until there is such a file, a minute at most.
inline void wait_for_file(const std::filesystem::path& path) {
  const UniqueFd watch(::inotify_init1(IN_CLOEXEC));
  ::inotify_add_watch(watch.get(), path.parent_path().c_str(), IN_CREATE | IN_MOVED_TO);
  while (!std::filesystem::exists(path)) {
    constexpr int kPatience_ms = 60'000;
    pollfd entry{watch.get(), POLLIN, 0};
    if (::poll(&entry, 1, kPatience_ms) <= 0) throw std::runtime_error("no " + path.string());
    alignas(inotify_event) char events[4096];
    [[maybe_unused]] const ssize_t count = ::read(watch.get(), events, sizeof events);
  }
}

inline Outcome run_bridge(const std::vector<std::string>& arguments) {
  return Bridge(arguments).finish();
}

inline std::size_t lines_in(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace tagwrench::test
