// Buttons to ground. The interrupt keeps the time of the first change; what is bouncing and what is
// not, the application decides.
#include "firmware/board/atmega328p/hardware.h"
#include "firmware/board/atmega328p/pins.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint8_t kButtons = 2;
constexpr uint8_t kButtonLines = kButton0 | kButton1;

volatile uint8_t changed;  ///< lines
volatile uint8_t lines_before;
uint32_t first_us[kButtons];

constexpr uint8_t button_line(uint8_t button) { return button == 0 ? kButton0 : kButton1; }

}  // namespace

void start_buttons() {
  PORTB |= kButtonLines;
  lines_before = kButtonLines;
  PCMSK0 = kButtonLines;
  PCICR |= 1 << PCIE0;
}

bool button_edge(uint8_t button, uint32_t& time_us) {
  const uint8_t line = button_line(button);
  if (!(changed & line)) return false;
  const Atomic atomic;
  changed &= static_cast<uint8_t>(~line);
  time_us = first_us[button];
  return true;
}

bool button_pressed(uint8_t button) { return (PINB & button_line(button)) == 0; }

}  // namespace board
}  // namespace tagwrench

ISR(PCINT0_vect) {
  using namespace tagwrench::board;
  const uint8_t lines = PINB & kButtonLines;
  const uint8_t news = static_cast<uint8_t>((lines ^ lines_before) & ~changed);
  lines_before = lines;
  if (news == 0) return;
  const uint32_t now = now_us_atomic();
  for (uint8_t i = 0; i < kButtons; ++i) {
    if (news & button_line(i)) first_us[i] = now;
  }
  changed |= news;
}
