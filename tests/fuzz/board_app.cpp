// The firmware's application: the input is what happens to a board, byte by byte: noise and good
// frames on its serial port, time, conversions, buttons, a port that takes nothing. Whatever comes,
// all that it sends decodes, and the LED is dark a host's longest timeout after the last frame.
#include <vector>

#include "firmware/app/app.h"
#include "tests/fuzz/expect.h"
#include "tests/unit/firmware/fake_board.h"
#include "tests/unit/protocol/messages.h"

namespace {

using namespace tagwrench::link;
using tagwrench::expect;
using tagwrench::board::fake_board;
using tagwrench::board::FakeBoard;

constexpr std::uint32_t kMaxTimeoutUs = 60000000;

class Input {
 public:
  Input(const std::uint8_t* bytes, std::size_t count) : at_(bytes), end_(bytes + count) {}
  bool empty() const { return at_ == end_; }
  std::uint8_t byte() { return empty() ? 0 : *at_++; }
  std::uint32_t number() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | byte();
    return value;
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

class Play {
 public:
  explicit Play(Input& input) : input_(input), app_(fresh(input)) {}

  void step() {
    switch (input_.byte() % 8) {
      case 0:
        for (std::uint8_t n = input_.byte() % 100; n > 0; --n) receive(input_.byte());
        return;
      case 1: return receive_frame();
      case 2: return run(input_.byte() * 20u);
      case 3: return run(input_.byte() * 20000u);
      case 4:
        board_.conversions.push_back({static_cast<std::uint8_t>(input_.byte() % 4),
                                      static_cast<std::int32_t>(input_.number()) >> 8,
                                      board_.now_us, input_.byte(), input_.byte() % 8 == 0});
        return;
      case 5:
        board_.measurements.push_back({static_cast<std::uint8_t>(input_.byte() % 2),
                                       static_cast<std::uint16_t>(input_.byte() * 4), board_.now_us,
                                       input_.byte()});
        return;
      case 6: return board_.change(input_.byte() % 2, input_.byte() % 2 == 1, board_.now_us);
      default:
        board_.room = input_.byte();
        board_.departed = input_.byte() % 2 == 1;
        board_.supply_mv = static_cast<std::uint16_t>(input_.number());
    }
  }

  /// To the end of any host's patience.
  void fall_silent() {
    board_.room = 255;
    for (std::size_t i = 0; i < 100 || !board_.incoming.empty(); ++i) run(1000);
    for (std::uint32_t t = 0; t < kMaxTimeoutUs; t += 50000) run(50000);
    run(1000);
    expect(board_.dark(), "the LED is dark when the host is silent");
  }

 private:
  static std::uint32_t fresh(Input& input) {
    fake_board() = FakeBoard{};
    return fake_board().now_us = input.number();
  }
  void receive(std::uint8_t byte) { board_.incoming.push_back({byte, board_.now_us}); }
  void receive_frame() {
    std::uint8_t body[kMaxBodyBytes];
    const auto count = static_cast<std::uint8_t>(kHeaderBytes + input_.byte() % 40);
    for (std::uint8_t i = 0; i < count; ++i) body[i] = input_.byte();
    body[0] = static_cast<std::uint8_t>(body[0] % 16);
    std::uint8_t frame[kMaxFrameBytes];
    const std::uint8_t bytes = write_frame(body, count, frame);
    for (std::uint8_t i = 0; i < bytes; ++i) receive(frame[i]);
  }
  void run(std::uint32_t duration_us) {
    board_.advance(duration_us);
    app_.poll(board_.now_us);
    expect(board_.steady_permille <= 1000, "no level beyond full");
    for (std::size_t i = 1; i < board_.waiting.size(); ++i)
      expect(static_cast<std::int32_t>(board_.waiting[i].at_us - board_.waiting[i - 1].at_us) > 0,
             "edges are queued in their order");
    expect(board_.waiting.size() <= 8, "no more edges than there is room for");
    take_in();
  }
  void take_in() {
    for (const std::uint8_t byte : board_.sent) {
      const Received received = reader_.take(byte);
      expect(received != Received::damaged, "what the board sends is whole");
      if (received == Received::frame) check_report();
    }
    board_.sent.clear();
  }
  void check_report() {
    bool known = false;
    Examples{}.each([&]<class Message>(Kind kind, const char*, const Message&) {
      if (static_cast<std::uint8_t>(kind) != reader_.kind()) return;
      known = reader_.kind() >= 0x80;
      Message message{};
      expect(decode(reader_.message(), reader_.message_bytes(), message), "a report decodes");
      const Bytes body = body_of(message, reader_.sequence());
      expect(Bytes(reader_.body(), reader_.body() + reader_.body_bytes()) == body,
             "and encodes to the same");
    });
    expect(known, "a report is of a kind of reports");
  }

  Input& input_;
  FakeBoard& board_ = fake_board();
  tagwrench::firmware::App app_;
  FrameReader reader_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  Input input(bytes, count);
  Play play(input);
  for (int steps = 0; steps < 300 && !input.empty(); ++steps) play.step();
  play.fall_silent();
  return 0;
}
