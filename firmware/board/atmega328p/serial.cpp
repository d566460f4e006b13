// UART with interrupts and a ring for each direction.
#include "firmware/board/atmega328p/hardware.h"

namespace tagwrench {
namespace board {
namespace {

/// Zero bytes, which end frames, are followed by their time in the ring.
constexpr uint8_t kStampBytes = 4;
constexpr uint8_t kReceiveBytes = 88;
constexpr uint8_t kSendBytes = 96;

/// Ticks of timer 1, half a microsecond each: a byte on the wire; from reading the timer to the
/// beginning of the start bit, which waits for the next tick of the baud rate; and from the end of
/// a byte to reading the timer in the interrupt.
constexpr uint16_t kByteTicks = 2 * 10000000ul / link::kBaud;
constexpr uint16_t kStartTicks = 2 * 2;
constexpr uint8_t kArrivalUs = 3;

volatile uint8_t received[kReceiveBytes];
volatile uint8_t received_head;
volatile uint8_t received_tail;
volatile uint8_t received_used;
volatile uint16_t overruns;
bool last_was_zero = true;

volatile uint8_t sending[kSendBytes];
volatile uint8_t sending_head;
volatile uint8_t sending_tail;
volatile uint8_t sending_used;

enum class Stamp : uint8_t { none, waiting, taken };
volatile Stamp departure;
volatile uint8_t departure_at;  ///< index in `sending`
uint16_t departure_ticks;
ClockReading departure_clock;  ///< about then
uint16_t line_free_ticks;      ///< when the last byte so far will have left

constexpr uint8_t next(uint8_t index, uint8_t size) {
  return index + 1 == size ? 0 : static_cast<uint8_t>(index + 1);
}

inline void put_received(uint8_t byte) {
  received[received_head] = byte;
  received_head = next(received_head, kReceiveBytes);
}

inline uint8_t take_received() {
  const uint8_t byte = received[received_tail];
  received_tail = next(received_tail, kReceiveBytes);
  return byte;
}

inline void receive(uint8_t byte) {
  if (byte != 0) {
    if (received_used == kReceiveBytes) {
      ++overruns;
      return;
    }
    last_was_zero = false;
    put_received(byte);
    ++received_used;
    return;
  }
  // Empty frames are nothing, and would fill the ring with times.
  if (last_was_zero) return;
  if (received_used > kReceiveBytes - 1 - kStampBytes) {
    ++overruns;
    return;
  }
  last_was_zero = true;
  const uint32_t now = now_us_atomic() - kArrivalUs;
  put_received(0);
  put_received(static_cast<uint8_t>(now));
  put_received(static_cast<uint8_t>(now >> 8));
  put_received(static_cast<uint8_t>(now >> 16));
  put_received(static_cast<uint8_t>(now >> 24));
  received_used = static_cast<uint8_t>(received_used + 1 + kStampBytes);
}

inline void transmit() {
  const uint8_t tail = sending_tail;
  // Unless all was sent long ago, the shift register has begun with the byte before.
  const bool idle = (UCSR0A & (1 << TXC0)) != 0;
  const uint16_t now_ticks = TCNT1;
  UCSR0A = 1 << TXC0;
  UDR0 = sending[tail];
  if (idle) line_free_ticks = now_ticks + kStartTicks;
  if (departure == Stamp::waiting && tail == departure_at) {
    departure_ticks = line_free_ticks;
    read_clock(departure_clock);
    departure = Stamp::taken;
  }
  line_free_ticks += kByteTicks;
  sending_tail = next(tail, kSendBytes);
  if (--sending_used == 0) UCSR0B &= static_cast<uint8_t>(~(1 << UDRIE0));
}

}  // namespace

void start_serial() {
  // 16 MHz / 16 / 2: exact, with the receiver's three samples a bit.
  static_assert(F_CPU / 16 / 2 == link::kBaud, "another divisor");
  UBRR0 = 1;
  UCSR0A = 0;
  UCSR0C = (1 << UCSZ01) | (1 << UCSZ00);
  UCSR0B = (1 << RXCIE0) | (1 << RXEN0) | (1 << TXEN0);
}

bool serial_take(SerialByte& byte) {
  // The interrupt has put a whole entry in before it counts it.
  if (received_used == 0) return false;
  byte.value = take_received();
  byte.time_us = 0;
  uint8_t taken = 1;
  if (byte.value == 0) {
    for (uint8_t shift = 0; shift < 32; shift = static_cast<uint8_t>(shift + 8))
      byte.time_us |= static_cast<uint32_t>(take_received()) << shift;
    taken = 1 + kStampBytes;
  }
  const Atomic atomic;
  received_used = static_cast<uint8_t>(received_used - taken);
  return true;
}

uint16_t serial_overruns() {
  const Atomic atomic;
  return overruns;
}

uint8_t serial_room() { return static_cast<uint8_t>(kSendBytes - sending_used); }

void serial_send(const uint8_t* bytes, uint8_t count, bool stamped) {
  if (stamped) {
    const Atomic atomic;
    departure_at = sending_head;
    departure = Stamp::waiting;
  }
  for (uint8_t i = 0; i < count; ++i) {
    sending[sending_head] = bytes[i];
    sending_head = next(sending_head, kSendBytes);
  }
  const Atomic atomic;
  sending_used = static_cast<uint8_t>(sending_used + count);
  UCSR0B |= 1 << UDRIE0;
}

bool serial_departure(uint32_t& time_us) {
  const Atomic atomic;
  const int16_t ahead_ticks = static_cast<int16_t>(departure_ticks - departure_clock.ticks);
  time_us = to_us(departure_clock) + static_cast<uint32_t>(ahead_ticks / 2);
  return departure == Stamp::taken;
}

}  // namespace board
}  // namespace tagwrench

ISR(USART_RX_vect) {
  using namespace tagwrench::board;
  // A second byte that waits already must not wait for the interrupts that come before this one.
  uint8_t state = UCSR0A;
  do {
    if (state & (1 << DOR0)) ++overruns;
    receive(UDR0);
    state = UCSR0A;
  } while (state & (1 << RXC0));
}

ISR(USART_UDRE_vect) { tagwrench::board::transmit(); }
