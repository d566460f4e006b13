// The board's id and the number of its starts, in EEPROM.
#include <avr/eeprom.h>

#include "firmware/board/atmega328p/hardware.h"

namespace tagwrench {
namespace board {
namespace {

// Addresses. The count comes after the bytes, so that an id that was cut short is none.
uint32_t* const kStarts = reinterpret_cast<uint32_t*>(0);
constexpr uint16_t kIdBytesAt = 4;
constexpr uint16_t kIdCountAt = kIdBytesAt + link::kIdBytes;

uint32_t starts;
link::UniqueId id;
volatile uint8_t to_write;  ///< bytes of the id, and its count, that are still to be written

uint8_t read_byte(uint16_t at) { return eeprom_read_byte(reinterpret_cast<const uint8_t*>(at)); }

}  // namespace

void start_eeprom() {
  starts = eeprom_read_dword(kStarts) + 1;
  eeprom_update_dword(kStarts, starts);
  id.count = read_byte(kIdCountAt);
  if (id.count > link::kIdBytes) id.count = 0;
  for (uint8_t i = 0; i < id.count; ++i) id.bytes[i] = read_byte(kIdBytesAt + i);
}

link::UniqueId unique_id() { return id; }

void keep_unique_id(const link::UniqueId& new_id) {
  id = new_id;
  to_write = link::kIdBytes + 1;
  EECR |= 1 << EERIE;
}

uint32_t boot_id() { return starts; }

}  // namespace board
}  // namespace tagwrench

ISR(EE_READY_vect) {
  using namespace tagwrench::board;
  using tagwrench::link::kIdBytes;
  if (to_write == 0) {
    EECR &= static_cast<uint8_t>(~(1 << EERIE));
    return;
  }
  const uint8_t done = kIdBytes + 1 - to_write;
  EEAR = kIdBytesAt + done;
  EEDR = done == kIdBytes ? id.count : id.bytes[done];
  EECR |= 1 << EEMPE;
  EECR |= 1 << EEPE;
  --to_write;
}
