// The board's id, and which of its starts this is.
#include <avr/eeprom.h>

#include "firmware/board/atmega328p/hardware.h"

namespace tagwrench {
namespace board {
namespace {

// Addresses. The count comes after the bytes, so that an id that was cut short is none.
constexpr uint16_t kIdBytesAt = 4;
constexpr uint16_t kIdCountAt = kIdBytesAt + link::kIdBytes;

// A cell of the EEPROM bears 100,000 writes. Starts are counted in a ring of slots, each one more
// than the slot before it; where that ends stands the latest. A slot whose writing was cut short
// breaks the ring there, and is the next to be written.
constexpr uint16_t kSlotsAt = 32;
constexpr uint8_t kSlots = 64;

/// What dies before that, again and again, must not wear the memory.
constexpr uint32_t kGoodLifeUs = 5000000;

/// Survives every reset but the loss of power: then it is noise, which the check tells.
struct Starts {
  uint32_t base;    ///< of the start with power
  uint32_t resets;  ///< since then
  uint32_t check;
};
Starts starts __attribute__((section(".noinit")));

uint32_t check_of(const Starts& s) { return ~(s.base ^ (s.resets + 0x5EED)); }

uint8_t slot;      ///< of the latest start that was kept
uint32_t counted;  ///< in that slot
bool is_kept;      ///< this start, or nothing is to be
link::UniqueId id;
volatile uint8_t count_to_write;  ///< bytes of `counted` that are still to be written
volatile uint8_t id_to_write;     ///< likewise of the id, and its count

uint8_t read_byte(uint16_t at) { return eeprom_read_byte(reinterpret_cast<const uint8_t*>(at)); }
uint16_t address_of(uint8_t of_slot) {
  return static_cast<uint16_t>(kSlotsAt + of_slot * sizeof(uint32_t));
}
uint32_t count_in(uint8_t of_slot) {
  return eeprom_read_dword(reinterpret_cast<const uint32_t*>(address_of(of_slot)));
}

/// Of memory that nobody has set: a power-up leaves some of its bits at random.
uint32_t noise() { return starts.base ^ starts.resets ^ starts.check; }

void find_latest() {
  counted = count_in(0);
  for (slot = 0; slot + 1 < kSlots; ++slot) {
    const uint32_t next = count_in(static_cast<uint8_t>(slot + 1));
    if (next != counted + 1) return;
    counted = next;
  }
}

void write_byte(uint16_t at, uint8_t value) {
  EEAR = at;
  EEDR = value;
  EECR |= 1 << EEMPE;
  EECR |= 1 << EEPE;
}

}  // namespace

void start_eeprom() {
  is_kept = starts.check == check_of(starts);
  if (is_kept) {
    ++starts.resets;
  } else {
    find_latest();
    // Starts that live long differ by their number, others by what power left in memory.
    starts.base = noise() + (counted << 16);
    starts.resets = 0;
  }
  starts.check = check_of(starts);
  id.count = read_byte(kIdCountAt);
  if (id.count > link::kIdBytes) id.count = 0;
  for (uint8_t i = 0; i < id.count; ++i) id.bytes[i] = read_byte(kIdBytesAt + i);
}

void keep_start(uint32_t now_us) {
  if (is_kept || now_us < kGoodLifeUs) return;
  is_kept = true;
  const Atomic atomic;
  slot = static_cast<uint8_t>((slot + 1) % kSlots);
  ++counted;
  count_to_write = sizeof counted;
  EECR |= 1 << EERIE;
}

link::UniqueId unique_id() { return id; }

void keep_unique_id(const link::UniqueId& new_id) {
  const Atomic atomic;
  id = new_id;
  id_to_write = link::kIdBytes + 1;
  EECR |= 1 << EERIE;
}

uint32_t boot_id() { return starts.base + starts.resets; }

}  // namespace board
}  // namespace tagwrench

ISR(EE_READY_vect) {
  using namespace tagwrench::board;
  using tagwrench::link::kIdBytes;
  if (count_to_write > 0) {
    const uint8_t done = sizeof counted - count_to_write;
    write_byte(address_of(slot) + done, reinterpret_cast<const uint8_t*>(&counted)[done]);
    --count_to_write;
  } else if (id_to_write > 0) {
    const uint8_t done = kIdBytes + 1 - id_to_write;
    write_byte(kIdBytesAt + done, done == kIdBytes ? id.count : id.bytes[done]);
    --id_to_write;
  } else {
    EECR &= static_cast<uint8_t>(~(1 << EERIE));
  }
}
