// The newest value of something, from one thread that must not wait to another that may.
#pragma once

#include <mutex>
#include <utility>

namespace tagwrench {

template <typename Value>
class Latest {
 public:
  /// Leaves it out if somebody reads just now.
  void put(const Value& value) noexcept {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock) value_ = value;
  }
  Value get() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }

 private:
  mutable std::mutex mutex_;
  Value value_{};
};

}  // namespace tagwrench
