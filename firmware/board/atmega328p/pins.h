// Where things are on an ATmega328P (Arduino Nano and Uno); README.md has the table for people.
#pragma once

#include <avr/io.h>

namespace tagwrench {
namespace board {

// Port B
constexpr uint8_t kButton0 = 1 << PB0;    // D8
constexpr uint8_t kLedPulses = 1 << PB1;  // D9, OC1A
constexpr uint8_t kButton1 = 1 << PB4;    // D12
constexpr uint8_t kHostLamp = 1 << PB5;   // D13
// Port C: the amplifiers' data lines are its bits 0..3 (A0..A3), the ADC's channels 4 and 5.
constexpr uint8_t kCells = 4;
constexpr uint8_t kDataLines = 0x0F;
constexpr uint8_t kFirstAdcPin = 4;
// Port D: the amplifiers' clocks are its bits 4..7 (D4..D7).
constexpr uint8_t kCellRate = 1 << PD2;   // D2
constexpr uint8_t kLedSteady = 1 << PD3;  // D3, OC2B
constexpr uint8_t kFirstClockPin = 4;

constexpr uint8_t data_line(uint8_t channel) { return static_cast<uint8_t>(1 << channel); }
constexpr uint8_t clock_line(uint8_t channel) {
  return static_cast<uint8_t>(1 << (kFirstClockPin + channel));
}

}  // namespace board
}  // namespace tagwrench
