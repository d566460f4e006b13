// HX711: its data line falls when a conversion is ready, which an interrupt stamps; the main loop
// clocks the bits out.
#include <util/delay_basic.h>

#include "firmware/board/atmega328p/hardware.h"
#include "firmware/board/atmega328p/pins.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint8_t kEntryUs = 3;  ///< from the line's fall to reading the clock

uint8_t input_pulses[kCells];  ///< 1 to 3 after the 24 bits choose the next input
volatile uint8_t ready;        ///< bit per channel
volatile uint8_t lines_before;
uint32_t ready_us[kCells];
volatile uint8_t lost[kCells];

/// One pulse, and the data line at its end. The amplifier sleeps after 60 us of high clock, so no
/// interrupt may come in between; between two pulses any may. Data are valid 0.1 us after the
/// clock's rise.
inline __attribute__((always_inline)) bool pulse(uint8_t clock, uint8_t line) {
  const Atomic atomic;
  PORTD |= clock;
  _delay_loop_1(1);
  const bool high = (PINC & line) != 0;
  PORTD &= static_cast<uint8_t>(~clock);
  return high;
}

uint8_t read_byte(uint8_t clock, uint8_t line) {
  uint8_t byte = 0;
  for (uint8_t i = 0; i < 8; ++i) {
    byte = static_cast<uint8_t>(byte << 1);
    if (pulse(clock, line)) byte |= 1;
  }
  return byte;
}

/// Interrupts are off. Forgets what the line did.
void watch(uint8_t channel) {
  const uint8_t line = data_line(channel);
  lines_before = static_cast<uint8_t>((lines_before & ~line) | (PINC & line));
  PCMSK1 |= line;
}

void ignore(uint8_t channel) { PCMSK1 &= static_cast<uint8_t>(~data_line(channel)); }

}  // namespace

void start_cells() {
  PORTC |= kDataLines;
  DDRD |= kCellRate;
  for (uint8_t i = 0; i < kCells; ++i) {
    DDRD |= clock_line(i);
    cell_input(i, link::CellInput::off);
  }
  PCICR |= 1 << PCIE1;
}

void cell_rate(uint8_t rate_sps) {
  const Atomic atomic;
  if (rate_sps == 80) {
    PORTD |= kCellRate;
  } else {
    PORTD &= static_cast<uint8_t>(~kCellRate);
  }
}

void cell_input(uint8_t channel, link::CellInput input) {
  const Atomic atomic;
  const uint8_t line = data_line(channel);
  ignore(channel);
  ready &= static_cast<uint8_t>(~line);
  lost[channel] = 0;
  if (input == link::CellInput::off) {
    PORTD |= clock_line(channel);
    return;
  }
  PORTD &= static_cast<uint8_t>(~clock_line(channel));
  input_pulses[channel] = static_cast<uint8_t>(input);
  watch(channel);
  // It may have been ready for long, and then its line does not fall.
  if (PINC & line) return;
  ready |= line;
  ready_us[channel] = now_us_atomic();
}

bool cell_take(Conversion& conversion) {
  const uint8_t waiting = ready;
  if (waiting == 0) return false;
  uint8_t channel = 0;
  while (!(waiting >> channel & 1)) ++channel;
  const uint8_t line = data_line(channel);
  conversion.channel = channel;
  {
    const Atomic atomic;
    ignore(channel);
    ready &= static_cast<uint8_t>(~line);
    conversion.time_us = ready_us[channel];
    conversion.lost = lost[channel];
    lost[channel] = 0;
  }
  const uint8_t clock = clock_line(channel);
  const uint8_t high = read_byte(clock, line);
  const uint8_t middle = read_byte(clock, line);
  const uint8_t low = read_byte(clock, line);
  for (uint8_t i = input_pulses[channel]; i > 0; --i) pulse(clock, line);
  const uint8_t sign = high & 0x80 ? 0xFF : 0;
  conversion.counts =
      static_cast<int32_t>(static_cast<uint32_t>(sign) << 24 | static_cast<uint32_t>(high) << 16 |
                           static_cast<uint16_t>(middle << 8) | low);
  const Atomic atomic;
  conversion.stuck = (PINC & line) == 0;
  watch(channel);
  return true;
}

}  // namespace board
}  // namespace tagwrench

ISR(PCINT1_vect) {
  using namespace tagwrench::board;
  const uint8_t lines = PINC;
  const uint8_t fell = lines_before & static_cast<uint8_t>(~lines) & PCMSK1;
  lines_before = lines;
  if (fell == 0) return;
  const uint32_t now = now_us_atomic() - kEntryUs;
  for (uint8_t i = 0; i < kCells; ++i) {
    if (!(fell & data_line(i))) continue;
    if (ready & data_line(i)) ++lost[i];
    ready_us[i] = now;
  }
  ready |= fell;
}
