// The program as somebody has it who sits at a terminal.
#pragma once

#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "host/os/unique_fd.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {

/// The program on a terminal of 80 x 24.
class OnTerminal {
 public:
  explicit OnTerminal(std::vector<std::string> arguments,
                      const std::vector<std::string>& environment = {},
                      const std::vector<int>& ignored = {}) {
    arguments.insert(arguments.begin(), TAGWRENCH_PROGRAM);
    winsize size{24, 80, 0, 0};
    int master = -1;
    pid_ = ::forkpty(&master, nullptr, nullptr, &size);
    if (pid_ == 0) {
      ::setenv("TERM", "xterm", 1);
      for (const std::string& variable : environment) ::putenv(::strdup(variable.c_str()));
      for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) std::signal(number, SIG_DFL);
      for (const int number : ignored) std::signal(number, SIG_IGN);
      std::vector<char*> argv;
      for (std::string& a : arguments) argv.push_back(a.data());
      argv.push_back(nullptr);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    terminal_.reset(master);
    ::tcgetattr(terminal_.get(), &before_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;
  ~OnTerminal() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }

  void type(const std::string& keys) {
    ASSERT_EQ(::write(terminal_.get(), keys.data(), keys.size()),
              static_cast<ssize_t>(keys.size()));
  }
  /// Waits until the screen shows a text (true) or the program has ended (false).
  bool shows(const std::string& text) {
    while (screen().find(text) == std::string::npos) {
      if (!pump()) return false;
    }
    return true;
  }
  /// shows() for a screen that does not show another text.
  bool shows(const std::string& text, const std::string& without) {
    while (shows(text) && (screen().find("\x1b[J") == std::string::npos ||
                           screen().find(without) != std::string::npos)) {
      if (!pump()) return false;
    }
    return screen().find(text) != std::string::npos;
  }
  /// The newest screen, as far as it has come.
  std::string screen() const {
    const std::size_t last = all_.rfind("\x1b[H");
    return last == std::string::npos ? all_ : all_.substr(last);
  }
  const std::string& all() const { return all_; }
  void signal(int number) { ::kill(pid_, number); }
  pid_t pid() const { return pid_; }
  /// Its exit status, or 128 + signal.
  int finish() {
    while (pump()) {
    }
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  /// Whether the terminal is as it was, cursor and screen too.
  bool restored() const {
    termios now{};
    ::tcgetattr(terminal_.get(), &now);
    return now.c_lflag == before_.c_lflag && now.c_iflag == before_.c_iflag &&
           all_.find("\x1b[?25h\x1b[?1049l") != std::string::npos;
  }

 private:
  bool pump() {
    char buffer[4096];
    const ssize_t size = ::read(terminal_.get(), buffer, sizeof buffer);  // EIO: nobody is there
    if (size > 0) all_.append(buffer, static_cast<std::size_t>(size));
    return size > 0;
  }

  pid_t pid_ = -1;
  UniqueFd terminal_;
  termios before_{};
  std::string all_;
};

}  // namespace tagwrench::test
