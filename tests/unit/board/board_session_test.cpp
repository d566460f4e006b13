#include <gtest/gtest.h>

#include <algorithm>

#include "board_session_fixture.h"
#include "protocol/pattern.h"

namespace tagwrench::link {
namespace {

TEST_F(BoardSessionTest, HandshakeConfiguresTheBoardAndStartsItsClock) {
  run(2);
  EXPECT_EQ(session.state(), BoardState::ready);
  EXPECT_TRUE(board.configured);
  EXPECT_EQ(board.configuration.cell_rate_sps, 80);
  EXPECT_EQ(board.configuration.host_timeout_ms, 5000);
  EXPECT_EQ(session.capabilities().led_levels, 256);
  EXPECT_TRUE(told(BoardEvent::Kind::connected));
  EXPECT_TRUE(session.clock().report().converged);
  EXPECT_NEAR(session.clock().report().skew_ppm, 1500, 50);
  EXPECT_EQ(session.counters().lost_frames, 0u);
}

TEST_F(BoardSessionTest, HelloIsRepeatedFourTimesASecondUntilAnswered) {
  board.answers = false;
  run(2);
  EXPECT_EQ(session.state(), BoardState::waiting);
  board.answers = true;
  const std::size_t hello_bytes = sent;
  EXPECT_GE(hello_bytes, 7u * 8);
  EXPECT_LE(hello_bytes, 9u * kMaxFrameBytes);
  run(0.5);
  EXPECT_EQ(session.state(), BoardState::ready);
}

TEST_F(BoardSessionTest, BootLoaderNoiseBeforeTheFirstFrameDoesNoHarm) {
  std::vector<std::uint8_t> noise(700);
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<std::uint8_t>(i * 37 % 251);
  session.take(noise, SyntheticLink::host(now));
  run(1);
  EXPECT_EQ(session.state(), BoardState::ready);
}

TEST_F(BoardSessionTest, ABoardWithTooOldFirmwareIsToBeUpdated) {
  board.hello.protocol_major = kProtocolMajor - 1;
  run(3);
  EXPECT_EQ(session.state(), BoardState::other_version);
  ASSERT_EQ(news.size(), 1u) << "said once";
  EXPECT_EQ(news[0].kind, BoardEvent::Kind::board_too_old);
  EXPECT_NE(text(news[0]).find("update the board"), std::string::npos) << text(news[0]);
  EXPECT_FALSE(board.configured);
  board.hello.protocol_major = kProtocolMajor;  // flashed
  board.hello.boot_id = 78;
  run(2);
  EXPECT_EQ(session.state(), BoardState::ready);
}

TEST_F(BoardSessionTest, ABoardWithNewerFirmwareNeedsANewerHost) {
  board.hello.protocol_major = kProtocolMajor + 1;
  run(2);
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].kind, BoardEvent::Kind::host_too_old);
  EXPECT_NE(text(news[0]).find("update tagwrench"), std::string::npos) << text(news[0]);
}

TEST_F(BoardSessionTest, AHigherMinorVersionIsSpokenTo) {
  board.hello.protocol_minor = kProtocolMinor + 5;
  run(1);
  EXPECT_EQ(session.state(), BoardState::ready);
}

TEST_F(BoardSessionTest, ABoardWithAnIdKeepsIt) {
  run(1);
  EXPECT_FALSE(told(BoardEvent::Kind::id_given));
  EXPECT_EQ(board.hello.unique_id.bytes[0], 1);
}

TEST_F(BoardSessionTest, ABoardWithoutIdIsGivenOne) {
  board.hello.unique_id = {};
  run(1);
  EXPECT_TRUE(told(BoardEvent::Kind::id_given));
  EXPECT_EQ(board.hello.unique_id.count, 8);
  EXPECT_EQ(board.hello.unique_id.bytes[0], 9);
  EXPECT_EQ(session.hello().unique_id.bytes[0], 9);
}

TEST_F(BoardSessionTest, ARefusedConfigurationIsSaid) {
  board.configure_result = Result::out_of_range;
  run(1);
  EXPECT_TRUE(told(BoardEvent::Kind::configuration_refused));
}

TEST_F(BoardSessionTest, ReadingsCarryHostTimeAndItsSigma) {
  run(5);
  const double when = now - 0.004;
  board.send_cell(2, -4711, when, 100);
  run(0.01);
  CellReading reading;
  ASSERT_TRUE(session.next(reading));
  EXPECT_EQ(reading.channel, 2);
  EXPECT_EQ(reading.counts, -4711);
  EXPECT_NEAR(SyntheticLink::seconds(reading.time.time - SyntheticLink::host(when)) * 1e6, 0, 60);
  EXPECT_GT(reading.time.sigma.count(), 0);
  EXPECT_LT(reading.time.sigma, std::chrono::microseconds(300));
  EXPECT_FALSE(session.next(reading));
}

TEST_F(BoardSessionTest, SamplesThatWaitedWhileTheHostWasHeldUpKeepTheirTime) {
  run(5);
  board.send_cell(0, 1, now, 100);
  const std::vector<std::uint8_t> bytes = board.take_out();
  session.take(bytes, SyntheticLink::host(now + 10));
  CellReading reading;
  ASSERT_TRUE(session.next(reading));
  EXPECT_NEAR(SyntheticLink::seconds(reading.time.time - SyntheticLink::host(now)) * 1e6, 0, 60);
}

TEST_F(BoardSessionTest, SamplesThatWaitedWhileTheLineWasCutAreLostAndCounted) {
  run(2);
  board.send_cell(0, 1, now, 100);
  run(0.01);
  CellReading reading;
  ASSERT_TRUE(session.next(reading));
  board.send_cell(0, 2, now, 101);  // waits in the driver
  const std::vector<std::uint8_t> stale = board.take_out();
  session.reconnect();
  session.take(stale, SyntheticLink::host(now + 3));
  EXPECT_FALSE(session.next(reading)) << "nobody knows yet whether it is of this start";
  run(1);
  ASSERT_EQ(session.state(), BoardState::ready);
  board.send_cell(0, 3, now, 102);
  run(0.01);
  ASSERT_TRUE(session.next(reading));
  EXPECT_EQ(reading.counts, 3);
  EXPECT_EQ(reading.lost_before, 1);
}

TEST_F(BoardSessionTest, LostConversionsAndFramesAreCountedAcrossTheWrapOfTheirNumbers) {
  run(1);
  board.send_cell(0, 1, now, 65534);
  board.send_cell(0, 1, now, 65535);
  board.send_cell(0, 1, now, 3);  // 0, 1, 2 are missing
  run(0.01);
  CellReading reading;
  std::vector<int> lost;
  while (session.next(reading)) lost.push_back(reading.lost_before);
  EXPECT_EQ(lost, (std::vector<int>{0, 0, 3}));
  EXPECT_EQ(session.counters().lost_conversions, 3u);

  connected = false;  // frames of these seconds are lost
  const std::uint64_t before = session.counters().lost_frames;
  board.send_cell(0, 1, now, 4);
  board.send_cell(0, 1, now, 5);
  run(0.002);
  connected = true;
  board.send_cell(0, 1, now, 6);
  run(0.01);
  EXPECT_GE(session.counters().lost_frames, before + 2);
}

TEST_F(BoardSessionTest, TheLatestReadingsStayWhenNobodyTakesThem) {
  run(1);
  for (int i = 0; i < 1500; ++i) {
    board.send_cell(0, i, now, static_cast<std::uint16_t>(i));
    if (i % 50 == 0) run(0.001);
  }
  run(0.01);
  CellReading reading;
  ASSERT_TRUE(session.next(reading));
  EXPECT_EQ(reading.counts, 1500 - 1024);
  EXPECT_EQ(session.overwritten(), 1500u - 1024u);
}

TEST_F(BoardSessionTest, TareIsRepeatedUntilAnsweredAndItsResultComes) {
  session.tare(1, 80);
  run(2);
  EXPECT_EQ(board.tares, 1u);
  TareResult result{};
  ASSERT_TRUE(session.next(result));
  EXPECT_EQ(result.mean_counts, 1234);
}

TEST_F(BoardSessionTest, TimeRequestsAreQuickAtFirstThenTenASecond) {
  run(0.6);
  const unsigned quick = board.time_requests;
  EXPECT_GE(quick, 20u);
  run(10);
  EXPECT_NEAR(board.time_requests - quick, 100, 6);
}

TEST_F(BoardSessionTest, BytesBehindAReplyDoNotMakeItLate) {
  chatter = 8;  // 160 bytes, 3 ms on the wire
  run(5);
  const double error = SyntheticLink::seconds(session.clock().to_host(clock.board_us(now)).time -
                                              SyntheticLink::host(now));
  EXPECT_NEAR(error * 1e6, 0, 60);
}

TEST_F(BoardSessionTest, AnOrderOnTheWireDoesNotMakeARequestLate) {
  run(2);
  double line_free = now;
  for (int i = 0; i < 500; ++i) {  // longer than the window
    const TimePoint due = session.next_poll();
    for (const double ahead : {0.1e-3, 0.0}) {  // an order right before each time request
      if (ahead > 0) session.set_led(steady(static_cast<std::uint16_t>(i)));
      now = SyntheticLink::seconds(due.time_since_epoch()) - ahead;
      std::uint8_t bytes[BoardSession::kMaxBytesOut];
      const std::size_t count = session.poll(SyntheticLink::host(now), bytes);
      line_free = std::max(line_free, now) + static_cast<double>(count) * 20e-6;
      board.take({bytes, count}, line_free);
      const std::vector<std::uint8_t> reply = board.take_out();
      const double back = line_free + static_cast<double>(reply.size()) * 20e-6;
      session.take(reply, SyntheticLink::host(back));
    }
  }
  const double error = SyntheticLink::seconds(session.clock().to_host(clock.board_us(now)).time -
                                              SyntheticLink::host(now));
  EXPECT_NEAR(error * 1e6, 0, 30);
}

TEST_F(BoardSessionTest, WhatCameBeforeTheFirstFrameIsKeptForTheMessage) {
  const std::string greeting = "OK start\r\n";
  session.take({reinterpret_cast<const std::uint8_t*>(greeting.data()), greeting.size()},
               SyntheticLink::host(now));
  const auto first = session.first_bytes();
  EXPECT_EQ(std::string(first.begin(), first.end()), greeting);
}

TEST_F(BoardSessionTest, AUselessFrameIsCountedAndChangesNothing) {
  run(1);
  std::uint8_t body[] = {0xE7, 0, 1, 2, 3};  // a kind of the future
  std::uint8_t frame[kMaxFrameBytes];
  const std::uint8_t count = write_frame(body, sizeof body, frame);
  session.take({frame, count}, SyntheticLink::host(now));
  std::uint8_t broken[] = {static_cast<std::uint8_t>(Kind::cell_sample), 1, 0xFF, 0xFF, 0xFF};
  session.take({frame, write_frame(broken, sizeof broken, frame)}, SyntheticLink::host(now));
  EXPECT_EQ(session.counters().unknown_frames, 2u);
  EXPECT_EQ(session.state(), BoardState::ready);
}

}  // namespace
}  // namespace tagwrench::link
