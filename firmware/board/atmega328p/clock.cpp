// Timer 1 runs freely at 2 MHz; its overflows make the upper part of the time.
#include "firmware/board/atmega328p/hardware.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint32_t kUsPerOverflow = 32768;
}  // namespace

volatile uint32_t overflows_us;

void start_clock() {
  TCCR1A = 0;
  TCCR1B = 1 << CS11;
  TIMSK1 = 1 << TOIE1;
}

uint32_t to_us(const ClockReading& reading) {
  uint32_t us = reading.overflows_us;
  // It may have overflowed just before, and its interrupt not have been served yet.
  if ((reading.flags & (1 << TOV1)) && reading.ticks < 0x8000) us += kUsPerOverflow;
  return us + (reading.ticks >> 1);
}

uint32_t now_us_atomic() {
  ClockReading reading;
  read_clock(reading);
  return to_us(reading);
}

uint32_t now_us() {
  const Atomic atomic;
  return now_us_atomic();
}

}  // namespace board
}  // namespace tagwrench

ISR(TIMER1_OVF_vect) { tagwrench::board::overflows_us += tagwrench::board::kUsPerOverflow; }
