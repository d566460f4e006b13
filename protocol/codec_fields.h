// Single fields between our structs and nanopb's.
#pragma once

#include <stdint.h>
#include <string.h>

#include "protocol/codec.h"

namespace tagwrench {
namespace link {

/// Enums count from 0 without a gap. False: `wire` is none that this version knows; nanopb takes
/// any number, so it must not be read as the enum that it then may not be.
template <class Wire, class Enum>
bool take_enum(const Wire& wire, Enum last, Enum& field) {
  unsigned value;
  static_assert(sizeof value == sizeof wire, "enums have the size of int");
  memcpy(&value, &wire, sizeof value);
  if (value > static_cast<unsigned>(last)) return false;
  field = static_cast<Enum>(value);
  return true;
}

/// At most `room` - 1 bytes and a zero. Both ways: nothing after the first zero counts.
template <uint8_t room>
void put_text(const char (&from)[room], char (&to)[room]) {
  uint8_t length = 0;
  while (length < room - 1 && from[length] != '\0') {
    to[length] = from[length];
    ++length;
  }
  while (length < room) to[length++] = '\0';
}

/// The same from the other side, whom nobody trusts with a terminal.
template <uint8_t room>
void take_text(const char (&from)[room], char (&to)[room]) {
  put_text(from, to);
  for (char& letter : to) {
    if (letter != '\0' && (letter < ' ' || letter > '~')) letter = '?';
  }
}

/// `Bytes` is nanopb's struct of a count and kIdBytes bytes.
template <class Bytes>
void put_id(const UniqueId& from, Bytes& to) {
  to.size = from.count < kIdBytes ? from.count : kIdBytes;
  for (uint8_t i = 0; i < kIdBytes; ++i) to.bytes[i] = i < to.size ? from.bytes[i] : 0;
}

template <class Bytes>
void take_id(const Bytes& from, UniqueId& to) {
  to.count = static_cast<uint8_t>(from.size);
  for (uint8_t i = 0; i < kIdBytes; ++i) to.bytes[i] = i < to.count ? from.bytes[i] : 0;
}

}  // namespace link
}  // namespace tagwrench
