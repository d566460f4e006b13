// A queue of bounded length that keeps the latest and counts what it lost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagwrench::link {

template <class T, std::size_t kRoom>
class Ring {
 public:
  void push(const T& value) noexcept {
    if (count_ == kRoom) {
      first_ = (first_ + 1) % kRoom;
      --count_;
      ++lost_;
    }
    items_[(first_ + count_) % kRoom] = value;
    ++count_;
  }

  /// Takes the oldest; false if there is none.
  bool pop(T& value) noexcept {
    if (count_ == 0) return false;
    value = items_[first_];
    first_ = (first_ + 1) % kRoom;
    --count_;
    return true;
  }

  void clear() noexcept { first_ = count_ = 0; }
  std::size_t size() const noexcept { return count_; }
  bool empty() const noexcept { return count_ == 0; }
  /// 0 is the oldest.
  const T& operator[](std::size_t i) const noexcept { return items_[(first_ + i) % kRoom]; }
  const T& back() const noexcept { return (*this)[count_ - 1]; }
  /// Overwritten before they were taken, since construction.
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  std::array<T, kRoom> items_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace tagwrench::link
