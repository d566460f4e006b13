// Faults wait here until there is room to send them.
#pragma once

#include "firmware/app/link.h"

namespace tagwrench {
namespace firmware {

class Faults {
 public:
  void raise(link::FaultCode code, uint8_t channel, uint32_t now_us) {
    if (count_ == kMax) {
      ++lost_;
      return;
    }
    waiting_[count_++] = {code, channel, now_us};
  }
  bool waiting() const { return count_ != 0; }
  /// Of those that came while too many waited; wraps.
  uint8_t lost() const { return lost_; }
  /// The oldest one; only if one waits.
  void send_one(Link& link) {
    if (!link.send(waiting_[0])) return;
    --count_;
    for (uint8_t i = 0; i < count_; ++i) waiting_[i] = waiting_[i + 1];
  }

 private:
  /// One for each cell at once, and one more.
  static constexpr uint8_t kMax = link::kMaxCells + 1;
  link::Fault waiting_[kMax] = {};
  uint8_t count_ = 0;
  uint8_t lost_ = 0;
};

}  // namespace firmware
}  // namespace tagwrench
