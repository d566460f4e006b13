// What the files of this board share. An interrupt routine may last 25 us and all of them together
// 40 us, because the receiver holds two bytes (40 us at 500,000 baud) before it loses one.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>

#include "firmware/board/board.h"

namespace tagwrench {
namespace board {

/// No interrupts as long as it lives. For a few instructions.
class Atomic {
 public:
  Atomic() : state_(SREG) { cli(); }
  ~Atomic() { SREG = state_; }
  Atomic(const Atomic&) = delete;
  Atomic& operator=(const Atomic&) = delete;

 private:
  uint8_t state_;
};

/// now_us() for where interrupts are off.
uint32_t now_us_atomic();

/// The clock as its registers stand, for an interrupt that is in a hurry; to_us() makes a time of
/// it later.
struct ClockReading {
  uint16_t ticks;  ///< of timer 1, half a microsecond each
  uint32_t overflows_us;
  uint8_t flags;
};
extern volatile uint32_t overflows_us;
inline void read_clock(ClockReading& reading) {
  reading.ticks = TCNT1;
  reading.flags = TIFR1;
  reading.overflows_us = overflows_us;
}
uint32_t to_us(const ClockReading& reading);

void start_clock();
void start_serial();
void start_led();
void start_cells();
void start_adc();
void start_buttons();
void start_eeprom();
/// Counts this start in the EEPROM once it has lived for some seconds; in the background.
void keep_start(uint32_t now_us);

}  // namespace board
}  // namespace tagwrench
