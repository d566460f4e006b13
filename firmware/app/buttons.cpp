#include "firmware/app/buttons.h"

#include "firmware/app/elapsed.h"

namespace tagwrench {
namespace firmware {
namespace {

/// Push buttons bounce for a few milliseconds.
constexpr uint32_t kSettledUs = 10000;

}  // namespace

void Buttons::poll(uint32_t now_us) {
  for (uint8_t i = 0; i < board::kTraits.buttons; ++i) {
    Button& button = buttons_[i];
    uint32_t edge_us;
    if (board::button_edge(i, edge_us)) {
      if (!button.bouncing) button.first_us = edge_us;
      button.bouncing = true;
      button.last_us = now_us;
    }
    if (!button.bouncing || !reached(now_us, button.last_us + kSettledUs)) continue;
    button.bouncing = false;
    if (board::button_pressed(i) == button.pressed) continue;
    button.pressed = !button.pressed;
    button.event_us = button.first_us;
    // An event that nobody took is lost, which its number shows.
    if (button.waiting) ++button.sequence;
    button.waiting = true;
  }
}

bool Buttons::send_one(Link& link) {
  for (uint8_t i = 0; i < board::kTraits.buttons; ++i) {
    Button& button = buttons_[i];
    if (!button.waiting) continue;
    if (link.send(link::ButtonEvent{i, button.pressed, button.event_us, button.sequence})) {
      ++button.sequence;
      button.waiting = false;
    }
    return true;
  }
  return false;
}

}  // namespace firmware
}  // namespace tagwrench
