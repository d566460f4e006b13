// The ADC goes round: each channel that is wanted, then the supply. Timer 1's compare unit B
// triggers it in hardware; the interrupt after a conversion chooses the next input, which so has
// the whole interval to settle, as the supply's reference needs, and moves the compare value on.
#include "firmware/board/atmega328p/hardware.h"
#include "firmware/board/atmega328p/pins.h"

namespace tagwrench {
namespace board {
namespace {

constexpr uint8_t kChannels = 2;
constexpr uint8_t kSupply = kChannels;  ///< taken for a channel, the last one of a round
constexpr uint8_t kTurns = kChannels + 1;
constexpr uint8_t kReferenceInput = 0x0E;
constexpr uint32_t kReferenceMv = 1100;  ///< 1.0 to 1.2 V from part to part (data sheet)
constexpr uint8_t kSupplyHz = 10;        ///< with no channel on

constexpr uint32_t kTicksPerSecond = F_CPU / 8;
/// A longer interval is made of several, whose conversions do not count: the timer wraps after
/// 65536.
constexpr uint16_t kMaxTicks = 0x8000;

uint32_t interval_ticks;
uint32_t ticks_left;    ///< from the next trigger to the one that counts
uint8_t order[kTurns];  ///< of a round
uint8_t last_turn;
uint8_t turn;
volatile uint16_t reference_counts;

struct Entry {
  uint32_t time_us;
  uint16_t counts;
  uint8_t channel;
  uint8_t lost;
};
constexpr uint8_t kEntries = 3;
Entry entries[kEntries];
uint8_t entries_head;
uint8_t entries_tail;
volatile uint8_t entries_used;
uint8_t lost[kChannels];

void select() {
  const uint8_t channel = order[turn];
  const uint8_t input = channel == kSupply ? kReferenceInput : kFirstAdcPin + channel;
  ADMUX = static_cast<uint8_t>((1 << REFS0) | input);
}

/// Moves the trigger on by at most kMaxTicks. Only a rising flag triggers.
void approach() {
  const uint16_t step = ticks_left > kMaxTicks ? kMaxTicks : static_cast<uint16_t>(ticks_left);
  ticks_left -= step;
  OCR1B += step;
  TIFR1 = 1 << OCF1B;
}

void keep(uint8_t channel, uint16_t counts) {
  if (entries_used == kEntries) {
    ++lost[channel];
    return;
  }
  const uint16_t ago_ticks = TCNT1 - OCR1B;
  Entry& entry = entries[entries_head];
  entry.time_us = now_us_atomic() - (ago_ticks >> 1);
  entry.counts = counts;
  entry.channel = channel;
  entry.lost = lost[channel];
  lost[channel] = 0;
  entries_head = entries_head == kEntries - 1 ? 0 : static_cast<uint8_t>(entries_head + 1);
  ++entries_used;
}

void finish(uint16_t counts) {
  const uint8_t channel = order[turn];
  turn = turn == last_turn ? 0 : static_cast<uint8_t>(turn + 1);
  select();
  if (channel == kSupply) {
    reference_counts = counts;
  } else {
    keep(channel, counts);
  }
  ticks_left = interval_ticks;
}

}  // namespace

void start_adc() {
  DIDR0 = (1 << ADC4D) | (1 << ADC5D);
  ADCSRB = (1 << ADTS2) | (1 << ADTS0);
  adc_start(0, 0);
}

void adc_start(uint8_t channel_mask, uint8_t rate_hz) {
  // Ends a conversion that is under way; no interrupt comes any more.
  ADCSRA = 0;
  uint8_t turns = 0;
  for (uint8_t i = 0; i < kChannels; ++i) {
    if (channel_mask >> i & 1) order[turns++] = i;
  }
  if (turns == 0) rate_hz = kSupplyHz;
  order[turns] = kSupply;
  last_turn = turns;
  turn = 0;
  select();
  interval_ticks = kTicksPerSecond / rate_hz / (turns + 1u);
  ticks_left = interval_ticks;
  entries_used = 0;
  entries_tail = entries_head;
  const Atomic atomic;
  OCR1B = TCNT1;
  approach();
  // 16 MHz / 128: 104 us for a conversion.
  ADCSRA = (1 << ADEN) | (1 << ADATE) | (1 << ADIE) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0);
}

bool adc_take(Measurement& measurement) {
  if (entries_used == 0) return false;
  const Entry& entry = entries[entries_tail];
  measurement = Measurement{entry.channel, entry.counts, entry.time_us, entry.lost};
  entries_tail = entries_tail == kEntries - 1 ? 0 : static_cast<uint8_t>(entries_tail + 1);
  const Atomic atomic;
  --entries_used;
  return true;
}

uint16_t supply_mv() {
  uint16_t counts;
  {
    const Atomic atomic;
    counts = reference_counts;
  }
  return counts == 0 ? 0 : static_cast<uint16_t>(kReferenceMv * 1024 / counts);
}

}  // namespace board
}  // namespace tagwrench

ISR(ADC_vect) {
  using namespace tagwrench::board;
  const uint16_t counts = ADC;
  if (ticks_left == 0) finish(counts);
  approach();
}
