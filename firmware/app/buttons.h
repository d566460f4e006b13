// Buttons: an event when the line has settled, with the time at which it first changed.
#pragma once

#include "firmware/app/link.h"

namespace tagwrench {
namespace firmware {

constexpr uint8_t kMaxButtons = 2;

class Buttons {
 public:
  void poll(uint32_t now_us);
  /// Sends one event that waits. False: there is none.
  bool send_one(Link& link);

 private:
  struct Button {
    bool pressed;  ///< as last told
    bool bouncing;
    bool waiting;  ///< to be sent
    uint16_t sequence;
    uint32_t first_us;  ///< first edge of this bouncing
    uint32_t last_us;   ///< when the last edge was seen
    uint32_t event_us;
  };
  Button buttons_[kMaxButtons] = {};
};

}  // namespace firmware
}  // namespace tagwrench
