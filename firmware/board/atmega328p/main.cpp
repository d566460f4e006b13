// Starts the ATmega328P and polls the application for ever.
#include <avr/wdt.h>
#include <string.h>

#include "firmware/app/app.h"
#include "firmware/board/atmega328p/hardware.h"
#include "firmware/board/atmega328p/pins.h"

extern "C" {
extern uint8_t _end;  ///< of what the linker placed in RAM
extern uint8_t __stack;
void keep_reset_cause() __attribute__((naked, used, section(".init3")));
void paint_stack() __attribute__((naked, used, section(".init1")));
}

namespace {

constexpr uint8_t kPaint = 0xC5;
uint8_t reset_flags __attribute__((section(".noinit")));

}  // namespace

/// Before anything is on the stack: what is still painted later was never used.
void paint_stack() {
  __asm volatile(
      "ldi r30, lo8(_end)\n"
      "ldi r31, hi8(_end)\n"
      "ldi r24, %0\n"
      "ldi r25, hi8(__stack)\n"
      "1: st Z+, r24\n"
      "cpi r30, lo8(__stack)\n"
      "cpc r31, r25\n"
      "brlo 1b\n"
      "breq 1b\n" ::"i"(static_cast<int>(kPaint)));
}

/// After a reset by it the watchdog stays on, at its shortest; so this comes first. A boot loader
/// may have cleared the flags before.
void keep_reset_cause() {
  reset_flags = MCUSR;
  MCUSR = 0;
  WDTCSR = (1 << WDCE) | (1 << WDE);
  WDTCSR = 0;
}

namespace tagwrench {
namespace board {

const Traits kTraits = {
    "atmega328p",
    4,        // cells
    2,        // adc_channels
    10,       // adc_bits
    2,        // buttons
    256,      // led_levels
    100,      // strobe_width_min_us: longer than an interrupt may be late
    20000,    // strobe_width_max_us
    2000,     // strobe_period_min_us: eight edges outlast the longest loop
    1000000,  // strobe_period_max_us
    1000,     // time_step_ns
    true,     // measures_supply
};

link::ResetCause reset_cause() {
  if (reset_flags & (1 << WDRF)) return link::ResetCause::watchdog;
  if (reset_flags & (1 << BORF)) return link::ResetCause::brown_out;
  if (reset_flags & (1 << EXTRF)) return link::ResetCause::pin;
  if (reset_flags & (1 << PORF)) return link::ResetCause::power_on;
  return link::ResetCause::unknown;
}

uint16_t stack_free_bytes() {
  const uint8_t* byte = &_end;
  while (*byte == kPaint) ++byte;
  return static_cast<uint16_t>(byte - &_end);
}

void host_lamp(bool on) {
  const Atomic atomic;
  PORTB = static_cast<uint8_t>(on ? PORTB | kHostLamp : PORTB & ~kHostLamp);
}

}  // namespace board
}  // namespace tagwrench

int main() {
  using namespace tagwrench;
  DDRB = board::kHostLamp;
  board::start_clock();
  board::start_led();
  board::start_cells();
  board::start_buttons();
  board::start_adc();
  board::start_eeprom();
  board::start_serial();
  wdt_enable(WDTO_250MS);
  sei();
  static firmware::App app(board::now_us());
  for (;;) {
    wdt_reset();
    app.poll(board::now_us());
    board::keep_start(board::now_us());
  }
}
