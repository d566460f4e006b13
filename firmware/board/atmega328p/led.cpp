// Steady light by timer 2's PWM on one pin, pulses by timer 1's compare unit on another; the pin
// that does not drive the transistor is an input. At reset both are, and the light is off.
//
// The compare unit changes the pin at the very half microsecond. The edges wait in a queue; the
// interrupt after each arms the next one. An edge that is armed after its time (that of the one
// before it may have been late, or interrupts were off) is made by force at once: light is late by
// some microseconds, never lost, and the schedule does not shift.
#include "firmware/board/atmega328p/hardware.h"
#include "firmware/board/atmega328p/pins.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint8_t kEdges = 8;
uint32_t edge_us[kEdges];
uint8_t edge_on;  ///< bit per edge
volatile uint8_t edges_head;
volatile uint8_t edges_tail;
volatile uint8_t edges_used;
volatile bool shining;  ///< the pin's level
bool armed;  ///< the next compare match is the oldest edge, not just a point on the way to it

constexpr uint8_t kCompareClears = 1 << COM1A1;
constexpr uint8_t kCompareSets = (1 << COM1A1) | (1 << COM1A0);
constexpr uint8_t kCompareMask = kCompareSets;

/// An edge further away than this is approached in steps: the timer wraps after 32.8 ms.
constexpr int32_t kFarUs = 20000;
constexpr uint16_t kStepTicks = 2 * 15000;
/// From here on the next match is surely ahead.
constexpr uint16_t kSoonTicks = 2 * 20;

void set_compare(bool on) {
  TCCR1A = static_cast<uint8_t>((TCCR1A & ~kCompareMask) | (on ? kCompareSets : kCompareClears));
}

void retire() {
  shining = (edge_on >> edges_tail) & 1;
  edges_tail = (edges_tail + 1) % kEdges;
  --edges_used;
}

/// A flag that is set already only makes the interrupt look once more.
void wait(uint16_t ticks) {
  armed = false;
  OCR1A = TCNT1 + ticks;
}

/// The bootloaders of Uno and Nano use other parts of the memory.
uint32_t heat_kept __attribute__((section(".noinit")));
uint16_t heat_check __attribute__((section(".noinit")));

uint16_t check_of(uint32_t heat) { return static_cast<uint16_t>(0xA55A ^ heat ^ (heat >> 16)); }

/// Interrupts are off. The pin keeps its level at matches that are not armed.
void arm() {
  set_compare(shining);
  if (edges_used == 0) {
    TIMSK1 &= static_cast<uint8_t>(~(1 << OCIE1A));
    return;
  }
  const uint32_t at_us = edge_us[edges_tail];
  if (static_cast<int32_t>(at_us - now_us_atomic()) > kFarUs) {
    wait(kStepTicks);
  } else {
    armed = true;
    OCR1A = static_cast<uint16_t>(at_us << 1);
    // From here on a match is this edge's and must not be lost. One that came before the compare
    // unit knew what to do is late by the clock.
    TIFR1 = 1 << OCF1A;
    set_compare((edge_on >> edges_tail) & 1);
    if (static_cast<int32_t>(now_us_atomic() - at_us) >= 0) {
      TCCR1C = 1 << FOC1A;
      retire();
      set_compare(shining);
      wait(kSoonTicks);
    }
  }
  TIMSK1 |= 1 << OCIE1A;
}

void drop_edges() {
  TIMSK1 &= static_cast<uint8_t>(~(1 << OCIE1A));
  edges_used = 0;
  edges_tail = edges_head;
  shining = false;
}

}  // namespace

void start_led() {
  // Phase-correct PWM without prescaler: 31.4 kHz, OCR2B of 255 parts, and no spike at 0.
  TCCR2A = 1 << WGM20;
  TCCR2B = 1 << CS20;
}

void led_steady(uint16_t permille) {
  {
    const Atomic atomic;
    drop_edges();
    DDRB &= static_cast<uint8_t>(~kLedPulses);
    TCCR1A = 0;
  }
  // To the nearest level, and between two to the lower one.
  const uint8_t level = static_cast<uint8_t>((permille * 255ul + 499) / 1000);
  OCR2B = level;
  if (level == 0) {
    TCCR2A &= static_cast<uint8_t>(~(1 << COM2B1));
    DDRD &= static_cast<uint8_t>(~kLedSteady);
  } else {
    TCCR2A |= 1 << COM2B1;
    DDRD |= kLedSteady;
  }
}

void led_pulses() {
  led_steady(0);
  const Atomic atomic;
  set_compare(false);
  TCCR1C = 1 << FOC1A;
  DDRB |= kLedPulses;
}

bool led_shining() { return shining; }

int32_t kept_heat() {
  return heat_check == check_of(heat_kept) ? static_cast<int32_t>(heat_kept) : 0;
}

void keep_heat(int32_t heat) {
  heat_kept = static_cast<uint32_t>(heat);
  heat_check = check_of(heat_kept);
}

uint8_t led_edge_room() { return static_cast<uint8_t>(kEdges - edges_used); }

void led_edge(uint32_t at_us, bool on) {
  const uint8_t head = edges_head;
  edge_us[head] = at_us;
  const uint8_t bit = static_cast<uint8_t>(1 << head);
  const Atomic atomic;
  edge_on = static_cast<uint8_t>(on ? edge_on | bit : edge_on & ~bit);
  edges_head = (head + 1) % kEdges;
  if (++edges_used == 1) arm();
}

}  // namespace board
}  // namespace tagwrench

ISR(TIMER1_COMPA_vect) {
  using namespace tagwrench::board;
  if (armed) retire();
  arm();
}
