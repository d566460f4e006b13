// Bytes <-> frames. A frame is COBS(body, CRC-16 of body, low byte first) and one zero byte; a body
// is kind, sequence and a message. Nothing here allocates, blocks or fails in a way that the next
// zero byte does not cure.
//
// C++14 without a standard library: board, host and fuzzer compile the same text.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace tagwrench {
namespace link {

constexpr uint8_t kMaxMessageBytes = 80;
constexpr uint8_t kHeaderBytes = 2;  ///< kind, sequence
constexpr uint8_t kCrcBytes = 2;
constexpr uint8_t kMaxBodyBytes = kHeaderBytes + kMaxMessageBytes;
/// On the wire: one COBS code byte, body, CRC, delimiter. A body this short needs no second code
/// byte.
constexpr uint8_t kMaxFrameBytes = 1 + kMaxBodyBytes + kCrcBytes + 1;

/// CRC-16/IBM-3740: polynomial 0x1021, initial value 0xFFFF, not reflected; of "123456789" 0x29B1.
uint16_t crc16(const uint8_t* bytes, uint8_t count);

/// Writes the frame of a body to `frame` (kMaxFrameBytes of room) and returns its length,
/// delimiter included; 0 if the body is longer than kMaxBodyBytes or shorter than its header. The
/// body may stand at frame + 1.
uint8_t write_frame(const uint8_t* body, uint8_t count, uint8_t* frame);

/// What one received byte completed.
enum class Received : uint8_t {
  nothing,  ///< in the middle of a frame, or an empty one (two delimiters in a row, which is no
            ///< error)
  frame,    ///< body() holds a frame whose CRC is right
  damaged,  ///< a frame ended whose length, encoding or CRC is wrong; it was dropped and counted.
            ///< A hit delimiter joins two frames, which are lost as one
};

/// Takes bytes as they come. Whatever they are: a damaged frame costs itself alone, the next frame
/// after a zero byte is read again.
class FrameReader {
 public:
  Received take(uint8_t byte);

  /// Valid after take() returned Received::frame, until the next take().
  const uint8_t* body() const { return body_; }
  uint8_t body_bytes() const { return body_bytes_; }

  uint8_t kind() const { return body_[0]; }
  uint8_t sequence() const { return body_[1]; }
  const uint8_t* message() const { return body_ + kHeaderBytes; }
  uint8_t message_bytes() const { return static_cast<uint8_t>(body_bytes_ - kHeaderBytes); }

  /// Since construction; wraps.
  uint16_t damaged_frames() const { return damaged_; }

 private:
  void begin();
  void store(uint8_t byte);
  Received finish();

  uint8_t body_[kMaxBodyBytes + kCrcBytes] = {};
  uint8_t body_bytes_ = 0;  ///< of the last good frame
  uint8_t count_ = 0;       ///< decoded so far
  uint8_t left_ = 0;        ///< bytes until the next COBS code byte
  bool zero_due_ = false;   ///< the block before ended with an implied zero
  bool started_ = false;    ///< a byte of this frame has come
  bool overlong_ = false;
  uint16_t damaged_ = 0;
};

}  // namespace link
}  // namespace tagwrench
