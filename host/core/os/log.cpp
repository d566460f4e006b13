#include "host/core/log.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/core/printable.h"

namespace tagwrench {
namespace {

/// The stream opened once more, so that O_NONBLOCK is of this descriptor alone; none where it
/// cannot be (a socket, another user's terminal).
UniqueFd opened_anew(int fd) noexcept {
  std::array<char, 32> path{"/proc/self/fd/"};
  std::to_chars(path.data() + 14, path.data() + path.size() - 1, fd);
  return UniqueFd(::open(path.data(), O_WRONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
}

}  // namespace

bool write_soon(int fd, std::string_view text, std::chrono::milliseconds patience) noexcept {
  struct stat about {};
  if (::fstat(fd, &about) != 0) return false;
  const bool socket = S_ISSOCK(about.st_mode);
  const bool stream = !S_ISREG(about.st_mode) && !socket;
  const UniqueFd own = stream ? opened_anew(fd) : UniqueFd();
  if (stream && !own && errno == ENXIO) return false;  // a pipe whose reader has gone
  const int to = own ? own.get() : fd;
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!text.empty()) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    pollfd room{to, POLLOUT, 0};
    const int ready = ::poll(&room, 1, left.count() > 0 ? static_cast<int>(left.count()) : 0);
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0 || (room.revents & POLLERR) != 0) return false;  // full, or nobody is left
    const ssize_t written = socket
                                ? ::send(to, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL)
                                : ::write(to, text.data(), text.size());
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

void log_info(std::string_view line) noexcept {
  std::string flat(line);
  std::replace_if(
      flat.begin(), flat.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  const std::string text = "tagwrench: " + printable(flat) + '\n';
  write_soon(STDERR_FILENO, text, std::chrono::milliseconds(20));
}

}  // namespace tagwrench
