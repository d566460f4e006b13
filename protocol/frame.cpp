#include "protocol/frame.h"

namespace tagwrench {
namespace link {
namespace {

constexpr uint8_t kDelimiter = 0;
/// A COBS code byte of 0xFF stands for 254 bytes without a zero after them. No frame of ours is
/// that long, so every block but the last is followed by the zero that it stands for.
static_assert(kMostBodyBytes + kCrcBytes < 254, "a frame has blocks of any length");

/// In bytes instead of words: what an 8-bit machine is fast at. `high` and `low` are the register.
void crc_add(uint8_t byte, uint8_t& high, uint8_t& low) {
  uint8_t x = static_cast<uint8_t>(high ^ byte);
  x = static_cast<uint8_t>(x ^ (x >> 4));
  high = static_cast<uint8_t>(low ^ (x << 4) ^ (x >> 3));
  low = static_cast<uint8_t>((x << 5) ^ x);
}

/// The COBS writer's state: where the present block's code byte is, and where the next byte goes.
struct Stuffer {
  uint8_t* frame;
  uint8_t code_at;
  uint8_t end;

  void add(uint8_t byte) {
    if (byte != kDelimiter) {
      frame[end++] = byte;
      return;
    }
    close_block();
    code_at = end++;
  }
  void close_block() { frame[code_at] = static_cast<uint8_t>(end - code_at); }
};

}  // namespace

uint16_t crc16(const uint8_t* bytes, uint8_t count) {
  uint8_t high = 0xFF;
  uint8_t low = 0xFF;
  for (uint8_t i = 0; i < count; ++i) crc_add(bytes[i], high, low);
  return static_cast<uint16_t>((high << 8) | low);
}

uint8_t write_frame(const uint8_t* body, uint8_t count, uint8_t* frame) {
  if (count < kHeaderBytes || count > kMostBodyBytes) return 0;
  const uint16_t crc = crc16(body, count);
  Stuffer stuffer{frame, 0, 1};
  for (uint8_t i = 0; i < count; ++i) stuffer.add(body[i]);
  stuffer.add(static_cast<uint8_t>(crc & 0xFF));
  stuffer.add(static_cast<uint8_t>(crc >> 8));
  stuffer.close_block();
  frame[stuffer.end++] = kDelimiter;
  return stuffer.end;
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
