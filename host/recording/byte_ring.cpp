#include "host/recording/byte_ring.h"

#include <algorithm>
#include <new>

namespace tagwrench::record {

ByteRing::ByteRing(std::size_t capacity)
    : storage_(std::max(capacity, 2 * kAlignment) / kAlignment * kAlignment + kAlignment) {
  const auto address = reinterpret_cast<std::uintptr_t>(storage_.data());
  memory_ = storage_.data() + (kAlignment - address % kAlignment) % kAlignment;
  capacity_ = storage_.size() - kAlignment;
}

std::byte* ByteRing::reserve(std::size_t bytes, std::size_t spare) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const std::uint64_t used = written - read_.load(std::memory_order_acquire);
  const std::size_t need = room_for(bytes);
  const std::size_t to_end = capacity_ - written % capacity_;
  const std::size_t skipped = need > to_end ? to_end : 0;
  if (bytes > capacity_ || used + skipped + need + spare > capacity_) return nullptr;
  if (skipped > 0) new (&header(written)) Header{kSkip, skipped};
  new (&header(written + skipped)) Header{bytes, need};
  reserved_ = written + skipped + need;
  return memory_ + (written + skipped) % capacity_ + kAlignment;
}

void ByteRing::publish() noexcept { written_.store(reserved_, std::memory_order_release); }

void ByteRing::wait_for_room() const noexcept {
  const std::uint64_t read = read_.load(std::memory_order_acquire);
  if (read != written_.load(std::memory_order_relaxed)) read_.wait(read);
}

bool ByteRing::could_hold(std::size_t bytes, std::size_t spare) const noexcept {
  return bytes < capacity_ / 2 && spare < capacity_ / 2 && 2 * room_for(bytes) + spare <= capacity_;
}

std::span<std::byte> ByteRing::front() noexcept {
  std::uint64_t read = read_.load(std::memory_order_relaxed);
  if (read == written_.load(std::memory_order_acquire)) return {};
  if (header(read).bytes == kSkip) {
    read += header(read).room;
    read_.store(read, std::memory_order_release);
  }
  return {memory_ + read % capacity_ + kAlignment, header(read).bytes};
}

void ByteRing::pop() noexcept {
  const std::uint64_t read = read_.load(std::memory_order_relaxed);
  read_.store(read + header(read).room, std::memory_order_release);
  read_.notify_one();
}

double ByteRing::fill() const noexcept {
  const std::uint64_t used =
      written_.load(std::memory_order_acquire) - read_.load(std::memory_order_acquire);
  return static_cast<double>(used) / static_cast<double>(capacity_);
}

}  // namespace tagwrench::record
