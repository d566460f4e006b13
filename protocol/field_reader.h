// Protobuf fields read one after the other with nanopb's stream functions. Its descriptors would do
// it too, but they take a third of an ATmega328P's flash.
#pragma once

#include <pb_decode.h>

#include "protocol/codec.h"

namespace tagwrench {
namespace link {

/// while (reader.next()) switch (reader.field()) read the field, or skip() it. What cannot be read
/// or does not fit ends the loop, and failed() is true then.
class FieldReader {
 public:
  FieldReader(const uint8_t* bytes, uint8_t count)
      : stream_(pb_istream_from_buffer(bytes, count)) {}

  bool next() {
    if (failed_ || stream_.bytes_left == 0) return false;
    bool eof;
    uint32_t tag;
    failed_ = !pb_decode_tag(&stream_, &wire_type_, &tag, &eof) || tag == 0;
    field_ = tag < kOther ? static_cast<uint8_t>(tag) : kOther;
    return !failed_;
  }
  bool failed() const { return failed_; }
  uint8_t field() const { return field_; }

  void skip() { check(pb_skip_field(&stream_, wire_type_)); }

  void varint(uint8_t& value) { value = static_cast<uint8_t>(varint_up_to(UINT8_MAX)); }
  void varint(uint16_t& value) { value = static_cast<uint16_t>(varint_up_to(UINT16_MAX)); }
  void fixed32(uint32_t& value) {
    check(wire_type_ == PB_WT_32BIT && pb_decode_fixed32(&stream_, &value));
  }

  /// Enums count from 0 without a gap; a value after `last` is none that this version knows.
  template <class Enum>
  void enumeration(Enum& value, Enum last) {
    value = static_cast<Enum>(varint_up_to(static_cast<uint8_t>(last)));
  }

  /// Adds to a list of at most `room`; a sender may pack them or not.
  template <class Enum, uint8_t room>
  void enumerations(Enum (&list)[room], uint8_t& count, Enum last) {
    if (wire_type_ == PB_WT_VARINT) {
      add_enumeration(list, count, last);
      return;
    }
    const uint8_t length = read_length();
    const uint8_t end = static_cast<uint8_t>(stream_.bytes_left - length);
    wire_type_ = PB_WT_VARINT;
    while (!failed_ && stream_.bytes_left > end) add_enumeration(list, count, last);
    check(stream_.bytes_left == end);
  }

  void bytes(uint8_t* to, uint8_t room, uint8_t& count) {
    const uint8_t length = read_length();
    count = length;
    check(length <= room && pb_read(&stream_, to, length));
  }

 private:
  static constexpr uint8_t kOther = 16;  ///< no field of ours has so high a number

  void check(bool good) { failed_ = failed_ || !good; }

  uint32_t varint_up_to(uint16_t most) {
    uint32_t value = 0;
    check(wire_type_ == PB_WT_VARINT && pb_decode_varint32(&stream_, &value) && value <= most);
    return failed_ ? 0 : value;
  }

  template <class Enum, uint8_t room>
  void add_enumeration(Enum (&list)[room], uint8_t& count, Enum last) {
    check(count < room);
    if (!failed_) enumeration(list[count++], last);
  }

  /// Of what comes next, and no more than is left.
  uint8_t read_length() {
    uint32_t length = 0;
    check(wire_type_ == PB_WT_STRING && pb_decode_varint32(&stream_, &length) &&
          length <= stream_.bytes_left);
    return failed_ ? 0 : static_cast<uint8_t>(length);
  }

  pb_istream_t stream_;
  pb_wire_type_t wire_type_ = PB_WT_VARINT;
  uint8_t field_ = 0;
  bool failed_ = false;
};

}  // namespace link
}  // namespace tagwrench
