// Frames: any bytes through the reader, and any body through writer and reader.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "protocol/frame.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench::link;
using tagwrench::expect;

/// What the reader says of any bytes holds: counts agree, and a frame that it accepts is the very
/// one that the writer makes of its body.
void read_anything(const std::uint8_t* bytes, std::size_t count) {
  FrameReader reader;
  std::uint16_t damaged = 0;
  std::vector<std::uint8_t> since_delimiter;
  for (std::size_t i = 0; i < count; ++i) {
    since_delimiter.push_back(bytes[i]);
    const Received received = reader.take(bytes[i]);
    if (received == Received::damaged) ++damaged;
    if (received == Received::frame) {
      std::uint8_t frame[kMaxFrameBytes];
      const std::uint8_t length = write_frame(reader.body(), reader.body_bytes(), frame);
      expect(std::ranges::equal(since_delimiter, std::vector(frame, frame + length)),
             "an accepted frame is what the writer writes");
    }
    if (bytes[i] == 0) {
      expect(received != Received::nothing || since_delimiter.size() == 1,
             "a delimiter after bytes completes a frame, good or damaged");
      since_delimiter.clear();
    } else {
      expect(received == Received::nothing, "only a delimiter completes a frame");
    }
    expect(reader.damaged_frames() == damaged, "each damaged frame is counted once");
  }
  // Whatever came before: after a delimiter the next frame is read.
  reader.take(0);
  const std::uint8_t body[] = {0x04, 0x01};
  std::uint8_t frame[kMaxFrameBytes];
  const std::uint8_t length = write_frame(body, sizeof body, frame);
  Received last = Received::nothing;
  for (std::uint8_t i = 0; i < length; ++i) last = reader.take(frame[i]);
  expect(last == Received::frame, "resynchronised after one delimiter");
}

void write_and_read(const std::uint8_t* bytes, std::size_t count) {
  const std::vector<std::uint8_t> body(bytes, bytes + std::min<std::size_t>(count, 255));
  std::vector<std::uint8_t> frame(kMaxFrameBytes);
  const std::uint8_t length =
      write_frame(body.data(), static_cast<std::uint8_t>(body.size()), frame.data());
  const bool fits = body.size() >= kHeaderBytes && body.size() <= kMaxBodyBytes;
  expect((length > 0) == fits, "a body is written exactly if its length is right");
  FrameReader reader;
  for (std::uint8_t i = 0; i < length; ++i) {
    const Received received = reader.take(frame[i]);
    expect(received == (i + 1 == length ? Received::frame : Received::nothing),
           "a written frame is complete with its last byte, and not before");
  }
  if (length > 0) {
    expect(std::equal(body.begin(), body.end(), reader.body(), reader.body() + reader.body_bytes()),
           "write and take are the identity");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  read_anything(bytes, count);
  write_and_read(bytes, count);
  return 0;
}
