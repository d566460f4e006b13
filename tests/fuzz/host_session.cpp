// The host's session against any board: raw bytes, frames with a right CRC around any body, and
// time that goes on in any steps.
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "host/board/board_session.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;
using namespace tagwrench::link;

constexpr std::uint32_t kSession = 0x5E55;

class Input {
 public:
  Input(const std::uint8_t* bytes, std::size_t count) : left_(bytes, count) {}
  bool empty() const { return left_.empty(); }
  std::uint8_t byte() { return take(1).empty() ? 0 : last_[0]; }
  std::span<const std::uint8_t> take(std::size_t count) {
    last_ = left_.first(std::min(count, left_.size()));
    left_ = left_.subspan(last_.size());
    return last_;
  }

 private:
  std::span<const std::uint8_t> left_;
  std::span<const std::uint8_t> last_;
};

BoardSessionOptions options() {
  BoardSessionOptions out;
  out.session = kSession;
  out.new_id = {{1, 2, 3, 4, 5, 6, 7, 8}, 8};
  return out;
}

/// What it sends are whole frames of requests.
void check_sent(const std::uint8_t* bytes, std::size_t count) {
  expect(count <= BoardSession::kMaxBytesOut, "one poll fits its room");
  expect(count == 0 || bytes[count - 1] == 0, "frames are sent whole");
  FrameReader reader;
  for (std::size_t i = 0; i < count; ++i) {
    const Received received = reader.take(bytes[i]);
    expect(received != Received::damaged, "what is sent is well formed");
    if (received == Received::frame) expect(reader.kind() < 0x80, "a host sends requests");
  }
}

void check_time(const HostTime& time) {
  expect(time.sigma.count() >= 0, "a standard deviation is not negative");
  expect(time.sigma >= time.random_sigma, "the whole is no less than its part");
}

class World {
 public:
  void play(Input& input) {
    while (!input.empty()) {
      const std::uint8_t op = input.byte();
      now_ += Duration(std::int64_t{input.byte()} * input.byte() * 40'000);  // up to 2.6 s
      const std::size_t count = op >> 2;
      if ((op & 3) == 0) {
        session_.take(input.take(count), now_);
      } else if ((op & 3) == 1) {
        take_frame(input.take(count));
      } else if ((op & 3) == 2) {
        greet(input);
      } else {
        order(input);
      }
      step();
    }
  }

 private:
  void take_frame(std::span<const std::uint8_t> body) {
    std::uint8_t frame[kMaxFrameBytes];
    const std::uint8_t length =
        write_frame(body.data(), static_cast<std::uint8_t>(body.size()), frame);
    session_.take({frame, length}, now_);
  }

  /// A greeting that fits, so that what comes after it is heard.
  void greet(Input& input) {
    Hello hello{};
    hello.protocol_major = kProtocolMajor;
    hello.boot_id = input.byte();
    hello.session = kSession;
    hello.unique_id.count = input.byte() % 9;
    std::uint8_t body[kMaxBodyBytes];
    take_frame({body, encode(hello, input.byte(), body)});
  }

  void order(Input& input) {
    Led led{};
    led.mode = static_cast<LedMode>(input.byte() % 4);
    led.period_us = input.byte() * 1000u;
    led.start_us = input.byte() * 0x01010101u;
    led.pattern_seed = input.byte();
    session_.set_led(led);
    session_.tare(input.byte(), 80);
  }

  void step() {
    std::uint8_t out[BoardSession::kMaxBytesOut];
    check_sent(out, session_.poll(now_, out));
    for (CellReading reading; session_.next(reading);) {
      expect(reading.channel < kMaxCells, "a channel that is told exists");
      check_time(reading.time);
    }
    for (AdcReading reading; session_.next(reading);) {
      expect(reading.channel < 8, "a channel that is told exists");
      check_time(reading.time);
    }
    for (ButtonReading reading; session_.next(reading);) check_time(reading.time);
    for (FaultReading reading; session_.next(reading);) check_time(reading.time);
    for (BoardEvent news; session_.next(news);) {
      const std::string line = text(news);
      expect(!line.empty() && line.find('\n') == std::string::npos, "news are one line");
    }
    const char* name = session_.hello().board;
    expect(std::all_of(name, std::find(name, name + sizeof session_.hello().board, '\0'),
                       [](char c) { return c >= 0x20 && c <= 0x7E; }),
           "a board's name is printable");
    expect(session_.counters().frames * 5 <= session_.counters().bytes,
           "a frame has at least five bytes");
  }

  BoardSession session_{options()};
  TimePoint now_{std::chrono::seconds(1000)};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  Input input(bytes, count);
  World().play(input);
  return 0;
}
