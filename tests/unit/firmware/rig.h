// The application on a fake board, and a host's end of its serial line.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <tuple>
#include <vector>

#include "firmware/app/app.h"
#include "tests/unit/firmware/fake_board.h"

namespace tagwrench::firmware {

class Rig : public testing::Test {
 protected:
  static constexpr std::uint32_t kPollUs = 500;

  Rig() : Rig(1000) {}
  explicit Rig(std::uint32_t start_us) : board(board::fake_board()), app_(fresh(start_us)) {}

  template <class Message>
  std::uint8_t send(const Message& message) {
    std::uint8_t body[link::kMaxBodyBytes];
    const std::uint8_t sequence = sequence_++;
    send_body(body, link::encode(message, sequence, body));
    return sequence;
  }
  void send_body(const std::uint8_t* body, std::uint8_t count) {
    std::uint8_t frame[link::kMaxFrameBytes];
    const std::uint8_t bytes = link::write_frame(body, count, frame);
    for (std::uint8_t i = 0; i < bytes; ++i) board.incoming.push_back({frame[i], board.now_us});
  }
  void send_raw(std::vector<std::uint8_t> body) {
    send_body(body.data(), static_cast<std::uint8_t>(body.size()));
  }

  /// Polls the application every kPollUs and takes in what it sends.
  void run(std::uint32_t duration_us) {
    for (std::uint32_t t = 0; t < duration_us; t += kPollUs) {
      board.advance(kPollUs);
      app_.poll(board.now_us);
      take_in();
    }
  }

  /// The board is reset: the application begins anew, with what outlives a reset.
  void restart() {
    board::led_steady(0);
    board.incoming.clear();
    app_ = App(board.now_us);
  }

  template <class Message>
  std::vector<Message>& all() {
    return std::get<std::vector<Message>>(reports_);
  }
  /// The result of a request; not_ready, with a failure, if no Answer came.
  template <class Message>
  link::Result ask(const Message& message) {
    const std::uint8_t sequence = send(message);
    const std::size_t before = all<link::Answer>().size();
    run(5000);
    if (all<link::Answer>().size() != before + 1) {
      ADD_FAILURE() << "not answered";
      return link::Result::not_ready;
    }
    EXPECT_EQ(all<link::Answer>().back().request_sequence, sequence);
    return all<link::Answer>().back().result;
  }
  void greet() {
    send(link::HelloRequest{link::kProtocolMajor, link::kProtocolMinor, 0x5E55});
    run(5000);
    ASSERT_FALSE(all<link::Hello>().empty());
  }
  static link::Configure configuration() {
    link::Configure all_on{};
    all_on.host_timeout_ms = 5000;
    all_on.cell_count = 4;
    for (auto& input : all_on.cells) input = link::CellInput::a128;
    all_on.cell_rate_sps = 80;
    all_on.adc_mask = 3;
    all_on.adc_rate_hz = 100;
    all_on.status_period_ms = 1000;
    return all_on;
  }
  static link::Led steady(std::uint16_t permille) {
    link::Led led{};
    led.mode = link::LedMode::steady;
    led.level_permille = permille;
    return led;
  }
  link::Fault last_fault() {
    return all<link::Fault>().empty() ? link::Fault{} : all<link::Fault>().back();
  }

  /// Of every report since the start: its frame's sequence.
  std::vector<std::uint8_t> frame_sequences;
  board::FakeBoard& board;

 private:
  static std::uint32_t fresh(std::uint32_t start_us) {
    board::fake_board() = board::FakeBoard{};
    board::fake_board().now_us = start_us;
    return start_us;
  }
  template <class Message>
  void keep() {
    Message message;
    ASSERT_TRUE(link::decode(reader_.message(), reader_.message_bytes(), message));
    all<Message>().push_back(message);
  }
  void take_in() {
    for (const std::uint8_t byte : board.sent) {
      const link::Received received = reader_.take(byte);
      ASSERT_NE(received, link::Received::damaged);
      if (received == link::Received::frame) keep_report();
    }
    board.sent.clear();
  }
  void keep_report() {
    frame_sequences.push_back(reader_.sequence());
    switch (static_cast<link::Kind>(reader_.kind())) {
      case link::Kind::hello: return keep<link::Hello>();
      case link::Kind::capabilities: return keep<link::Capabilities>();
      case link::Kind::cell_sample: return keep<link::CellSample>();
      case link::Kind::adc_sample: return keep<link::AdcSample>();
      case link::Kind::button_event: return keep<link::ButtonEvent>();
      case link::Kind::time_reply: return keep<link::TimeReply>();
      case link::Kind::status: return keep<link::Status>();
      case link::Kind::answer: return keep<link::Answer>();
      case link::Kind::tare_result: return keep<link::TareResult>();
      case link::Kind::fault: return keep<link::Fault>();
      default: ADD_FAILURE() << "a report of unknown kind " << int{reader_.kind()};
    }
  }

  App app_;
  link::FrameReader reader_;
  std::uint8_t sequence_ = 0;
  std::tuple<std::vector<link::Hello>, std::vector<link::Capabilities>,
             std::vector<link::CellSample>, std::vector<link::AdcSample>,
             std::vector<link::ButtonEvent>, std::vector<link::TimeReply>,
             std::vector<link::Status>, std::vector<link::Answer>, std::vector<link::TareResult>,
             std::vector<link::Fault>>
      reports_;
};

}  // namespace tagwrench::firmware
