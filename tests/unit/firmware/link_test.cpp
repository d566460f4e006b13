// The wire: requests answered whatever they are, time in two steps, no room.
#include "tests/unit/firmware/firmware_test.h"

namespace tagwrench::firmware {
namespace {

class FirmwareLink : public Firmware {};

TEST_P(FirmwareLink, AnUnknownKindIsAnsweredAndCounted) {
  greet();
  send_raw({0x7E, 200, 1, 2, 3});
  run(5000);
  ASSERT_EQ(all<link::Answer>().size(), 1u);
  EXPECT_EQ(all<link::Answer>().front().request_kind, 0x7E);
  EXPECT_EQ(all<link::Answer>().front().request_sequence, 200);
  EXPECT_EQ(all<link::Answer>().front().result, link::Result::unknown_kind);
  run(1100000);
  EXPECT_EQ(all<link::Status>().back().unknown_kinds, 1);
}

TEST_P(FirmwareLink, AReportIsCountedAndNotAnsweredSoThatAnEchoComesToAnEnd) {
  greet();
  send_raw({static_cast<std::uint8_t>(link::Kind::answer), 0, 8, 1});
  run(1100000);
  EXPECT_TRUE(all<link::Answer>().empty());
  EXPECT_EQ(all<link::Status>().back().unknown_kinds, 1);
}

TEST_P(FirmwareLink, AMessageThatIsNoneIsAnsweredMalformed) {
  greet();
  for (std::uint8_t kind = 1; kind <= 6; ++kind) {
    send_raw({kind, kind, 0xFF});
    run(5000);
    ASSERT_EQ(all<link::Answer>().size(), kind);
    EXPECT_EQ(all<link::Answer>().back().request_kind, kind);
    EXPECT_EQ(all<link::Answer>().back().result, link::Result::malformed);
  }
}

TEST_P(FirmwareLink, DamagedFramesAreCountedAndNotAnswered) {
  greet();
  for (const std::uint8_t byte : {5, 4, 3, 2, 1, 0}) board.incoming.push_back({byte, 0});
  run(1100000);
  EXPECT_EQ(all<link::Status>().back().bad_frames, 1);
  EXPECT_TRUE(all<link::Answer>().empty());
  EXPECT_EQ(ask(steady(10)), link::Result::ok);
}

TEST_P(FirmwareLink, FramesAreNumberedWithoutAGap) {
  greet();
  for (int i = 0; i < 600; ++i) {
    send(link::TimeRequest{});
    run(kPollUs);
  }
  ASSERT_GT(frame_sequences.size(), 600u);
  for (std::size_t i = 1; i < frame_sequences.size(); ++i)
    ASSERT_EQ(frame_sequences[i], static_cast<std::uint8_t>(frame_sequences[i - 1] + 1));
}

TEST_P(FirmwareLink, TimeReplyHasTheArrivalAndTheDepartureOfTheOneBefore) {
  greet();
  const std::uint8_t first = send(link::TimeRequest{});
  board.incoming.back().time_us = 111;
  run(2 * kPollUs);
  ASSERT_EQ(all<link::TimeReply>().size(), 1u);
  EXPECT_EQ(all<link::TimeReply>()[0].request_sequence, first);
  EXPECT_EQ(all<link::TimeReply>()[0].received_us, 111u);
  EXPECT_FALSE(all<link::TimeReply>()[0].previous_valid);
  board.departure_us = 222;
  const std::uint8_t second = send(link::TimeRequest{});
  board.incoming.back().time_us = 333;
  run(2 * kPollUs);
  ASSERT_EQ(all<link::TimeReply>().size(), 2u);
  const link::TimeReply reply = all<link::TimeReply>()[1];
  EXPECT_EQ(reply.request_sequence, second);
  EXPECT_EQ(reply.received_us, 333u);
  ASSERT_TRUE(reply.previous_valid);
  EXPECT_EQ(reply.previous_request_sequence, first);
  EXPECT_EQ(reply.previous_sent_us, 222u);
}

TEST_P(FirmwareLink, ADepartureThatHasNotBeenYetIsNotTold) {
  greet();
  send(link::TimeRequest{});
  run(2 * kPollUs);
  board.departed = false;
  send(link::TimeRequest{});
  run(2 * kPollUs);
  ASSERT_EQ(all<link::TimeReply>().size(), 2u);
  EXPECT_FALSE(all<link::TimeReply>()[1].previous_valid);
}

TEST_P(FirmwareLink, TheRoomThatIsAskedForIsThatOfTheLongestReports) {
  const auto frame_bytes = [](const auto& message) {
    std::uint8_t frame[link::kMaxFrameBytes];
    return link::write_frame(frame + 1, link::encode(message, 255, frame + 1), frame);
  };
  const std::uint32_t most = 0xFFFFFFFF;
  EXPECT_EQ(frame_bytes(link::CellSample{3, -0x800000, most, 0xFFFF, 0xFFFF, true}),
            Link::kMaxSampleBytes);
  EXPECT_LE(frame_bytes(link::AdcSample{1, 0xFFFF, most, 0xFFFF}), Link::kMaxSampleBytes);
  EXPECT_EQ(frame_bytes(link::TimeReply{255, most, 255, most, true}), Link::kMaxAnswerBytes);
  EXPECT_LE(frame_bytes(link::Answer{255, 255, link::Result::already_set}), Link::kMaxAnswerBytes);
}

TEST_P(FirmwareLink, ARequestWaitsUntilThereIsRoomForItsAnswer) {
  greet();
  board.room = 23;
  send(steady(50));
  run(100000);
  EXPECT_TRUE(all<link::Answer>().empty());
  EXPECT_EQ(board.steady_permille, 0);
  board.room = 24;
  run(2 * kPollUs);
  ASSERT_EQ(all<link::Answer>().size(), 1u);
  EXPECT_EQ(board.steady_permille, 50);
}

TEST_P(FirmwareLink, FaultsThatWaitedTooLongForRoomAreCounted) {
  greet();
  ASSERT_EQ(ask(configuration()), link::Result::ok);
  // Four cells fall silent, the LED gets hot, and then the host falls silent: one more than can
  // wait.
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  board.room = 24;
  run_alive(11000000);
  EXPECT_TRUE(all<link::Fault>().empty());
  run(5200000);
  board.room = 255;
  run(1100000);
  EXPECT_EQ(all<link::Fault>().size(), 5u);
  ASSERT_FALSE(all<link::Status>().empty());
  EXPECT_EQ(all<link::Status>().back().dropped_reports, 1);
}

TEST_P(FirmwareLink, TheLightGoesOffWhenNothingCanBeSentAnyMore) {
  greet();
  ASSERT_EQ(ask(steady(50)), link::Result::ok);
  board.room = 0;
  run_alive(5200000);
  EXPECT_TRUE(board.dark());
}

INSTANTIATE_TEST_SUITE_P(Clock, FirmwareLink, kClockStarts);

}  // namespace
}  // namespace tagwrench::firmware
