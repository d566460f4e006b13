// A board for tests of the host's side: answers as protocol/ says, on a virtual line with delays.
// Knows nothing of the firmware.
#pragma once

#include <cstring>
#include <deque>
#include <span>
#include <vector>

#include "protocol/codec.h"
#include "protocol/frame.h"
#include "synthetic_link.h"

namespace tagwrench::link {

/// Times are seconds of the host's clock.
class BoardModel {
 public:
  Hello hello{};
  Capabilities capabilities{};
  Result configure_result = Result::ok;
  Result led_result = Result::ok;
  TareResult tare_result{0, 1234, 4, 80};
  bool answers = true;
  bool configured = false;
  Configure configuration{};
  std::vector<Led> leds;
  std::vector<double> led_times;
  unsigned hello_requests = 0;
  unsigned time_requests = 0;
  unsigned tares = 0;
  unsigned requests = 0;

  explicit BoardModel(SyntheticLink& clock) : clock_(clock) {
    hello.protocol_major = kProtocolMajor;
    hello.protocol_minor = kProtocolMinor;
    std::strcpy(hello.board, "model");
    std::strcpy(hello.firmware, "0.1.0");
    hello.unique_id = {{1, 2, 3, 4, 5, 6, 7, 8}, 8};
    hello.boot_id = 77;
    hello.reset_cause = ResetCause::power_on;
    capabilities.cells = 4;
    capabilities.led_levels = 256;
  }

  void restart(std::uint32_t boot_id, double now) {
    hello.boot_id = boot_id;
    hello.reset_cause = ResetCause::watchdog;
    hello.session = 0;
    configured = false;
    previous_valid_ = false;
    sequence_ = 0;
    clock_.set_board_start(-clock_.board(now) + clock_.board(SyntheticLink::kStart));
  }

  /// Bytes from the host, complete at time `now`.
  void take(std::span<const std::uint8_t> bytes, double now) {
    for (const std::uint8_t byte : bytes) {
      if (reader_.take(byte) == Received::frame && answers) handle(now);
    }
  }

  template <class Message>
  void send(const Message& message) {
    std::uint8_t body[kMaxBodyBytes];
    std::uint8_t frame[kMaxFrameBytes];
    const std::uint8_t count = encode(message, sequence_++, body);
    out.insert(out.end(), frame, frame + write_frame(body, count, frame));
  }

  void send_cell(std::uint8_t channel, std::int32_t counts, double now, std::uint16_t sequence) {
    send(CellSample{channel, counts, clock_.board_us(now), sequence, 0, false});
  }

  std::vector<std::uint8_t> take_out() { return std::exchange(out, {}); }

  std::vector<std::uint8_t> out;

 private:
  template <class Message>
  Message read() {
    Message message{};
    EXPECT_TRUE(decode(reader_.message(), reader_.message_bytes(), message));
    return message;
  }

  void handle(double now) {
    ++requests;
    switch (static_cast<Kind>(reader_.kind())) {
      case Kind::hello_request:
        ++hello_requests;
        hello.session = read<HelloRequest>().session;
        send(hello);
        send(capabilities);
        return;
      case Kind::configure:
        configuration = read<Configure>();
        configured = configure_result == Result::ok;
        return answer(configure_result);
      case Kind::led:
        leds.push_back(read<Led>());
        led_times.push_back(now);
        return answer(led_result);
      case Kind::set_id: hello.unique_id = read<SetId>().unique_id; return answer(Result::ok);
      case Kind::tare:
        ++tares;
        answer(Result::ok);
        return send(tare_result);
      case Kind::time_request:
        ++time_requests;
        send(TimeReply{reader_.sequence(), clock_.board_us(now), previous_sequence_,
                       clock_.board_us(previous_sent_), previous_valid_});
        previous_sequence_ = reader_.sequence();
        previous_sent_ = now;  // the model sends at once
        previous_valid_ = true;
        return;
      default: return answer(Result::unknown_kind);
    }
  }
  void answer(Result result) { send(Answer{reader_.kind(), reader_.sequence(), result}); }

  SyntheticLink& clock_;
  FrameReader reader_;
  std::uint8_t sequence_ = 0;
  std::uint8_t previous_sequence_ = 0;
  double previous_sent_ = 0;
  bool previous_valid_ = false;
};

}  // namespace tagwrench::link
