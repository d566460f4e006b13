// What a page is still to be sent, while it is busy with what it was sent before: bounded, whatever
// it does.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

class Outbox {
 public:
  static constexpr std::size_t kMaxKept = 64;
  static constexpr std::size_t kMaxTypes = 16;

  /// Goes out, in its turn. False: 64 wait already.
  bool keep(std::shared_ptr<const std::string> text);
  /// Takes the place of the one of its type that waits.
  void replace(std::string_view type, std::shared_ptr<const std::string> text);
  void replace_picture(std::shared_ptr<const std::vector<std::uint8_t>> picture);

  /// Those that are kept in their order, then the latest of each type; null: there is none.
  std::shared_ptr<const std::string> next_text();
  std::shared_ptr<const std::vector<std::uint8_t>> next_picture();

 private:
  std::deque<std::shared_ptr<const std::string>> kept_;
  std::deque<std::pair<std::string, std::shared_ptr<const std::string>>> latest_;
  std::shared_ptr<const std::vector<std::uint8_t>> picture_;
};

// Counts what comes in a second. Pure.

template <std::size_t kMax>
class MessageRate {
 public:
  /// False: it is more than kMax in the last second.
  bool count(TimePoint now) noexcept {
    TimePoint& oldest = times_[next_];
    const bool too_many = full_ && now - oldest < std::chrono::seconds(1);
    oldest = now;
    next_ = (next_ + 1) % kMax;
    full_ = full_ || next_ == 0;
    return !too_many;
  }

 private:
  std::array<TimePoint, kMax> times_{};
  std::size_t next_ = 0;
  bool full_ = false;
};

}  // namespace tagwrench
