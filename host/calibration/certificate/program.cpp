#include "host/calibration/certificate/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"

extern char** environ;

namespace tagwrench {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

/// A file in memory: neither side can block the other, as with pipes.
class Buffer {
 public:
  Buffer() : fd_(::memfd_create("tagwrench", MFD_CLOEXEC)) {
    if (!fd_) fail("memfd_create");
  }
  int fd() const { return fd_.get(); }

  void fill(std::string_view text) {
    while (!text.empty()) {
      const ssize_t n = ::write(fd_.get(), text.data(), text.size());
      if (n < 0) fail("write");
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    if (::lseek(fd_.get(), 0, SEEK_SET) != 0) fail("lseek");
  }
  std::string contents() const {
    const off_t size = ::lseek(fd_.get(), 0, SEEK_END);
    if (size < 0) fail("lseek");
    std::string text(static_cast<std::size_t>(size), '\0');
    std::size_t done = 0;
    while (done < text.size()) {
      const ssize_t n =
          ::pread(fd_.get(), text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (n <= 0) fail("read");
      done += static_cast<std::size_t>(n);
    }
    return text;
  }

 private:
  UniqueFd fd_;
};

std::string last_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const std::size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

pid_t start(const Program& program, const std::vector<std::string>& arguments, int in, int out,
            int err) {
  std::vector<std::string> all(1, program.name);
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& a : all) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t pid = -1;
  const int error =
      ::posix_spawnp(&pid, program.name.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == 0) return pid;
  throw ConfigError(fmt::format("{}: {}; install it (Debian: apt install {})", program.name,
                                error == ENOENT ? "is not installed" : std::strerror(error),
                                program.package));
}

/// Its wait status; if it takes longer than that, it is ended.
int wait(pid_t pid, std::chrono::seconds patience, bool& in_time) {
  // By number: sys/pidfd.h of glibc 2.36 is not made for C++.
  const UniqueFd handle(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  pollfd entry{handle.get(), POLLIN, 0};
  const auto patience_ms =
      static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(patience).count());
  int ready = 0;
  do {
    ready = ::poll(&entry, 1, patience_ms);
  } while (ready < 0 && errno == EINTR);
  in_time = ready > 0;
  if (!in_time) ::kill(pid, SIGKILL);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string run_program(const Program& program, const std::vector<std::string>& arguments,
                        std::string_view input, std::chrono::seconds patience) {
  Buffer in;
  Buffer out;
  Buffer err;
  in.fill(input);
  const pid_t pid = start(program, arguments, in.fd(), out.fd(), err.fd());
  bool in_time = false;
  const int status = wait(pid, patience, in_time);
  if (!in_time) {
    throw std::runtime_error(
        fmt::format("{} did not end within {} s", program.name, patience.count()));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const std::string said = last_line(err.contents());
    throw std::runtime_error(
        fmt::format("{} failed: {}", program.name, said.empty() ? "it does not say why" : said));
  }
  return out.contents();
}

}  // namespace tagwrench
