// Any bytes through the OptoForce parser, in any pieces, and its counters through the clock.
#include "host/board/optoforce.h"

#include <cstdint>
#include <span>
#include <vector>

#include "host/board/clock_sync.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;
using namespace tagwrench::link;

constexpr std::size_t kMaxFrame = 34;

std::vector<std::uint8_t> good_frame() {
  std::vector<std::uint8_t> out{0xAA, 0x07, 0x08, 0x0A, 0x12, 0x34, 0, 0, 1, 2, 3, 4, 5, 6};
  unsigned sum = 0;
  for (const std::uint8_t byte : out) sum += byte;
  out.push_back(static_cast<std::uint8_t>(sum >> 8));
  out.push_back(static_cast<std::uint8_t>(sum));
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  OptoforceParser parser;
  CounterClock clock(0.01);
  TimePoint now{std::chrono::seconds(1000)};
  std::uint64_t frame_bytes = 0;
  std::uint64_t frames = 0;
  const auto use = [&](const OptoforceFrame& frame) {
    expect(frame.axes == 3 || frame.axes == 6 || frame.axes == 12, "a frame has 3, 6 or 12 axes");
    frame_bytes += 10 + 2 * std::uint64_t{frame.axes};
    ++frames;
    expect(status_text(frame.status).find('\n') == std::string::npos, "trouble is one line");
    const HostTime time = clock.take(frame.counter, now);
    expect(time.sigma.count() >= 0, "a standard deviation is not negative");
    expect(clock.period() > 0, "time goes forward");
  };
  std::span<const std::uint8_t> left(bytes, count);
  while (!left.empty()) {
    const std::size_t piece = std::min<std::size_t>(left.size(), 1 + left[0] % 64);
    now += Duration(std::int64_t{left[0]} * 1'000'000);
    parser.take(left.first(piece), use);
    left = left.subspan(piece);
  }
  const auto& counters = parser.counters();
  expect(counters.frames == frames, "each frame is counted once");
  expect(counters.interruptions <= counters.frames, "an interruption lies between two frames");
  const std::uint64_t used = frame_bytes + counters.skipped_bytes + 7 * counters.replies;
  expect(used <= count && count - used < kMaxFrame, "every byte is accounted for");

  // Whatever came before: after zeros that no frame can hold back, the next frame is read.
  parser.take(std::vector<std::uint8_t>(kMaxFrame, 0), use);
  bool read = false;
  parser.take(good_frame(), [&](const OptoforceFrame& frame) { read = frame.counter == 0x1234; });
  expect(read, "the parser resynchronises");
  return 0;
}
