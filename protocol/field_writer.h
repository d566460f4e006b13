// Protobuf fields written by hand, following the protobuf encoding (protobuf.dev, "Encoding"): a
// field is a tag (number * 8 + wire type) and a value, and proto3 omits fields that are zero.
#pragma once

#include "protocol/codec.h"

namespace tagwrench {
namespace link {

/// Writes fields of fewer than 16 in number behind a body's header. The body has room for what is
/// written: messages fit.
class FieldWriter {
 public:
  FieldWriter(Kind kind, uint8_t sequence, uint8_t* body) : body_(body), end_(body) {
    *end_++ = static_cast<uint8_t>(kind);
    *end_++ = sequence;
  }

  void varint(uint8_t field, uint16_t value) {
    if (value == 0) return;
    *end_ = tag(field, kVarint);
    end_ = put(end_ + 1, value);
  }

  void varint32(uint8_t field, uint32_t value) {
    if (value == 0) return;
    uint8_t* end = end_;
    *end++ = tag(field, kVarint);
    while (value >= 0x10000) {
      *end++ = static_cast<uint8_t>(value | 0x80);
      value >>= 7;
    }
    end_ = put(end, static_cast<uint16_t>(value));
  }

  /// Zigzag: 0, -1, 1, -2 ... become 0, 1, 2, 3 ...
  void sint32(uint8_t field, int32_t value) {
    const uint32_t doubled = static_cast<uint32_t>(value) << 1;
    varint32(field, value < 0 ? ~doubled : doubled);
  }

  void fixed32(uint8_t field, uint32_t value) {
    if (value == 0) return;
    uint8_t* end = end_;
    *end++ = tag(field, kFixed32);
    *end++ = static_cast<uint8_t>(value);
    *end++ = static_cast<uint8_t>(value >> 8);
    *end++ = static_cast<uint8_t>(value >> 16);
    *end++ = static_cast<uint8_t>(value >> 24);
    end_ = end;
  }

  void bytes(uint8_t field, const void* bytes, uint8_t count) {
    if (count == 0) return;
    *end_++ = tag(field, kLengthFirst);
    *end_++ = count;
    for (uint8_t i = 0; i < count; ++i) *end_++ = static_cast<const uint8_t*>(bytes)[i];
  }

  /// Zeros included; fewer than 40 of them.
  void packed(uint8_t field, const uint16_t* values, uint8_t count) {
    if (count == 0) return;
    *end_++ = tag(field, kLengthFirst);
    uint8_t* length_at = end_++;
    for (uint8_t i = 0; i < count; ++i) end_ = put(end_, values[i]);
    *length_at = static_cast<uint8_t>(end_ - length_at - 1);
  }

  /// Of the whole body.
  uint8_t count() const { return static_cast<uint8_t>(end_ - body_); }

 private:
  static constexpr uint8_t kVarint = 0;
  static constexpr uint8_t kLengthFirst = 2;
  static constexpr uint8_t kFixed32 = 5;
  static constexpr uint8_t tag(uint8_t field, uint8_t wire_type) {
    return static_cast<uint8_t>((field << 3) | wire_type);
  }

  /// Returns what comes after it. The pointer stays in registers, which halves the time that an
  /// 8-bit machine needs.
  static uint8_t* put(uint8_t* end, uint16_t value) {
    while (value >= 0x80) {
      *end++ = static_cast<uint8_t>(value | 0x80);
      value = static_cast<uint16_t>(value >> 7);
    }
    *end++ = static_cast<uint8_t>(value);
    return end;
  }

  uint8_t* body_;
  uint8_t* end_;
};

}  // namespace link
}  // namespace tagwrench
