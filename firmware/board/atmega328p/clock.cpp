// Timer 1 runs freely at 2 MHz; its overflows make the upper part of the time.
#include "firmware/board/atmega328p/hardware.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint32_t kUsPerOverflow = 32768;
volatile uint32_t overflows_us;

}  // namespace

void start_clock() {
  TCCR1A = 0;
  TCCR1B = 1 << CS11;
  TIMSK1 = 1 << TOIE1;
}

uint32_t now_us_atomic() {
  const uint16_t ticks = TCNT1;
  uint32_t us = overflows_us;
  // It may have overflowed just now, and its interrupt not been served yet.
  if ((TIFR1 & (1 << TOV1)) && ticks < 0x8000) us += kUsPerOverflow;
  return us + (ticks >> 1);
}

uint32_t now_us() {
  const Atomic atomic;
  return now_us_atomic();
}

}  // namespace board
}  // namespace tagwrench

ISR(TIMER1_OVF_vect) { tagwrench::board::overflows_us += tagwrench::board::kUsPerOverflow; }
