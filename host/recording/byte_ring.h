// Records of any size from one thread to another, through memory that was taken beforehand.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagwrench::record {

/// One thread writes, another reads. Neither waits unless it asks to.
class ByteRing {
 public:
  static constexpr std::size_t kAlignment = 64;

  explicit ByteRing(std::size_t capacity);

  // ---- The writing thread ----

  /// Room for a record of so many bytes, aligned, in one piece; nullptr if there is none now. At
  /// least `spare` bytes stay free. Nothing is in the ring until publish().
  std::byte* reserve(std::size_t bytes, std::size_t spare = 0) noexcept;
  void publish() noexcept;
  /// Sleeps until the reader has taken something, unless the ring is empty.
  void wait_for_room() const noexcept;
  /// Whether a record of so many bytes fits into an empty ring.
  bool could_hold(std::size_t bytes, std::size_t spare = 0) const noexcept;

  // ---- The reading thread ----

  /// The oldest record; empty if there is none.
  std::span<std::byte> front() noexcept;
  void pop() noexcept;

  /// Either thread: part of the room that is taken, 0..1.
  double fill() const noexcept;

 private:
  struct Header {
    std::size_t bytes;  ///< of the record; kSkip: nothing more up to the end of the memory
    std::size_t room;   ///< taken by all of it
  };
  static constexpr std::size_t kSkip = ~std::size_t{0};
  static std::size_t room_for(std::size_t bytes) noexcept {
    return kAlignment + (bytes + kAlignment - 1) / kAlignment * kAlignment;
  }
  Header& header(std::uint64_t position) noexcept {
    return *reinterpret_cast<Header*>(memory_ + position % capacity_);
  }

  std::vector<std::byte> storage_;
  std::byte* memory_;
  std::size_t capacity_;
  std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> read_{0};
  std::uint64_t reserved_ = 0;  ///< `written_` after the next publish()
};

}  // namespace tagwrench::record
