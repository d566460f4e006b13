// Some bytes as a regular file, for readers that take a path; in memory, gone with the object.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/core/printable.h"
#include "tests/fuzz/expect.h"

namespace tagwrench::fuzz {

class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : file_(::memfd_create("fuzz", MFD_CLOEXEC)) {
    const bool written =
        ::write(file_.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
    expect(written, "there is memory for a file");
  }
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_.get()); }

 private:
  UniqueFd file_;
};

/// A refusal is one line, and not empty. That a terminal does not obey it, printable() sees to.
inline void check_refusal(const ConfigError& error) {
  const std::string_view line = error.what();
  expect(!line.empty(), "a refusal says something");
  expect(printable(line).find('\x1b') == std::string::npos, "no terminal obeys it");
}

/// The first byte chooses, the others are the text.
struct Choice {
  Choice(const std::uint8_t* bytes, std::size_t count)
      : kind(count == 0 ? 0 : bytes[0]),
        text(reinterpret_cast<const char*>(bytes) + (count == 0 ? 0 : 1),
             count == 0 ? 0 : count - 1) {}
  unsigned kind;
  std::string text;
};

}  // namespace tagwrench::fuzz
