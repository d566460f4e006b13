// Bytes that end where memory ends: reading or writing one too many ends the program.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>
#include <system_error>

namespace tagwrench::link {

class GuardedBytes {
 public:
  explicit GuardedBytes(std::span<const std::uint8_t> bytes)
      : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))), count_(bytes.size()) {
    memory_ = mmap(nullptr, 2 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory_ == MAP_FAILED || mprotect(begin() + page_, page_, PROT_NONE) != 0) {
      throw std::system_error(errno, std::generic_category(), "guard page");
    }
    std::ranges::copy(bytes, data());
  }
  GuardedBytes(const GuardedBytes&) = delete;
  GuardedBytes& operator=(const GuardedBytes&) = delete;
  ~GuardedBytes() { munmap(memory_, 2 * page_); }

  std::uint8_t* data() { return begin() + page_ - count_; }
  std::uint8_t count() const { return static_cast<std::uint8_t>(count_); }

 private:
  std::uint8_t* begin() { return static_cast<std::uint8_t*>(memory_); }

  std::size_t page_;
  std::size_t count_;
  void* memory_;
};

}  // namespace tagwrench::link
