#include "protocol/frame.h"

namespace tagwrench {
namespace link {
namespace {

constexpr uint8_t kDelimiter = 0;
/// A COBS code byte of 0xFF stands for 254 bytes without a zero after them. No frame of ours is
/// that long, so every block but the last is followed by the zero that it stands for.
static_assert(kMaxBodyBytes + kCrcBytes < 254, "a frame has blocks of any length");

/// In bytes, step by step: what an 8-bit machine and its compiler are fast at.
inline uint16_t crc_add(uint16_t crc, uint8_t byte) {
  uint8_t x = static_cast<uint8_t>((crc >> 8) ^ byte);
  x = static_cast<uint8_t>(x ^ (x >> 4));
  const uint8_t x_16 = static_cast<uint8_t>(x << 4);
  const uint8_t x_32 = static_cast<uint8_t>(x_16 << 1);
  const uint8_t x_eighth = static_cast<uint8_t>(x >> 3);
  const uint8_t high = static_cast<uint8_t>(static_cast<uint8_t>(crc) ^ x_16 ^ x_eighth);
  return static_cast<uint16_t>((high << 8) | static_cast<uint8_t>(x_32 ^ x));
}

constexpr uint16_t kCrcStart = 0xFFFF;

}  // namespace

uint16_t crc16(const uint8_t* bytes, uint8_t count) {
  uint16_t crc = kCrcStart;
  for (uint8_t i = 0; i < count; ++i) crc = crc_add(crc, bytes[i]);
  return crc;
}

uint8_t write_frame(const uint8_t* body, uint8_t count, uint8_t* frame) {
  if (count < kHeaderBytes || count > kMaxBodyBytes) return 0;
  uint16_t crc = kCrcStart;
  uint8_t* code = frame;  // of the present block: will hold its length
  uint8_t* end = frame + 1;
  for (uint8_t left = static_cast<uint8_t>(count + kCrcBytes); left > 0; --left) {
    uint8_t byte;
    if (left > kCrcBytes) {
      byte = *body++;
      crc = crc_add(crc, byte);
    } else {
      byte = static_cast<uint8_t>(crc);
      crc = static_cast<uint16_t>(crc >> 8);
    }
    if (byte == kDelimiter) {
      *code = static_cast<uint8_t>(end - code);
      code = end;
    }
    *end++ = byte;
  }
  *code = static_cast<uint8_t>(end - code);
  *end++ = kDelimiter;
  return static_cast<uint8_t>(end - frame);
}

void FrameReader::begin() {
  count_ = 0;
  left_ = 0;
  zero_due_ = false;
  started_ = false;
  overlong_ = false;
}

void FrameReader::store(uint8_t byte) {
  if (count_ < sizeof(body_)) {
    body_[count_++] = byte;
  } else {
    overlong_ = true;
  }
}

Received FrameReader::take(uint8_t byte) {
  if (byte == kDelimiter) return started_ ? finish() : Received::nothing;
  started_ = true;
  if (left_ == 0) {
    if (zero_due_) store(0);
    zero_due_ = true;
    left_ = static_cast<uint8_t>(byte - 1);
  } else {
    store(byte);
    --left_;
  }
  return Received::nothing;
}

Received FrameReader::finish() {
  const uint8_t count = count_;
  const bool complete = left_ == 0 && !overlong_ && count >= kHeaderBytes + kCrcBytes;
  begin();
  if (complete) {
    const uint8_t body_bytes = static_cast<uint8_t>(count - kCrcBytes);
    const uint16_t crc = static_cast<uint16_t>(body_[body_bytes] |
                                               (static_cast<uint16_t>(body_[body_bytes + 1]) << 8));
    if (crc == crc16(body_, body_bytes)) {
      body_bytes_ = body_bytes;
      return Received::frame;
    }
  }
  body_bytes_ = kHeaderBytes;
  ++damaged_;
  return Received::damaged;
}

}  // namespace link
}  // namespace tagwrench
