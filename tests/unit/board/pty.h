// A pseudo-terminal: its far side stands for the device, its path for the port.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench::link {

class Pty {
 public:
  Pty() { open(); }

  const std::string& path() const { return path_; }
  int fd() const { return master_.get(); }
  void unplug() { master_.reset(); }
  void open() {
    master_.reset(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    char name[64];
    if (!master_ || ::grantpt(fd()) != 0 || ::unlockpt(fd()) != 0 ||
        ::ptsname_r(fd(), name, sizeof name) != 0)
      throw std::runtime_error("no pseudo-terminal");
    path_ = name;
  }

  std::vector<std::uint8_t> read() {
    std::vector<std::uint8_t> out(4096);
    const ssize_t count = ::read(fd(), out.data(), out.size());
    out.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return out;
  }
  void write(std::span<const std::uint8_t> bytes) {
    if (::write(fd(), bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("the pseudo-terminal is full");
  }
  void write(const std::string& text) {
    write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }

 private:
  UniqueFd master_;
  std::string path_;
};

inline bool readable(int fd, int timeout_ms = 5000) {
  pollfd entry{fd, POLLIN, 0};
  return ::poll(&entry, 1, timeout_ms) > 0;
}

}  // namespace tagwrench::link
