// Data addresses and bits of the ATmega328P (datasheet DS40002061, section 30), as far as the
// models need them.
#pragma once

#include <cstdint>

namespace tagwrench::emulator::reg {

constexpr std::uint16_t kPinB = 0x23, kDdrB = 0x24, kPortB = 0x25;
constexpr std::uint16_t kPinC = 0x26, kDdrC = 0x27, kPortC = 0x28;
constexpr std::uint16_t kPinD = 0x29, kDdrD = 0x2A, kPortD = 0x2B;
constexpr std::uint16_t kTifr1 = 0x36, kPcifr = 0x3B, kEecr = 0x3F;
constexpr std::uint16_t kMcusr = 0x54, kSpl = 0x5D, kSph = 0x5E;
constexpr std::uint16_t kTimsk1 = 0x6F, kTimsk2 = 0x70;
constexpr std::uint16_t kAdcl = 0x78, kAdch = 0x79, kAdcsra = 0x7A, kAdcsrb = 0x7B, kAdmux = 0x7C;
constexpr std::uint16_t kTccr1a = 0x80, kTccr1b = 0x81, kTccr1c = 0x82;
constexpr std::uint16_t kTcnt1l = 0x84, kTcnt1h = 0x85, kOcr1al = 0x88, kOcr1ah = 0x89;
constexpr std::uint16_t kOcr1bl = 0x8A, kOcr1bh = 0x8B;
constexpr std::uint16_t kTccr2a = 0xB0, kTccr2b = 0xB1, kTcnt2 = 0xB2, kOcr2a = 0xB3, kOcr2b = 0xB4;
constexpr std::uint16_t kUcsr0a = 0xC0, kUcsr0b = 0xC1, kUcsr0c = 0xC2, kUbrr0l = 0xC4;
constexpr std::uint16_t kUbrr0h = 0xC5, kUdr0 = 0xC6;
constexpr std::uint16_t kRamBegin = 0x100;

/// Interrupt vectors by number, as simavr counts them (0 is reset).
enum Vector : std::uint8_t {
  kPcint0 = 3,
  kPcint1 = 4,
  kPcint2 = 5,
  kTimer1CompA = 11,
  kTimer1CompB = 12,
  kTimer1Overflow = 13,
  kUsartRx = 18,
  kUsartDataEmpty = 19,
  kUsartTx = 20,
  kAdcDone = 21,
  kEepromReady = 22,
  kVectors = 26,
};

}  // namespace tagwrench::emulator::reg
