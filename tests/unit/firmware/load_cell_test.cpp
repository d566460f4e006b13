// Load cells: samples with sequence and losses, faults instead of zeros, rate and tare.
#include "tests/unit/firmware/firmware_test.h"

namespace tagwrench::firmware {
namespace {

constexpr std::uint32_t kPeriodUs = 12500;

class FirmwareCell : public Firmware {
 protected:
  void configure() {
    greet();
    ASSERT_EQ(ask(configuration()), link::Result::ok);
  }
  void convert(std::uint8_t channel, std::int32_t counts, std::uint8_t lost = 0,
               bool stuck = false) {
    board.conversions.push_back({channel, counts, board.now_us, lost, stuck});
    run(2 * kPollUs);
  }
  /// All four cells convert 80 times a second, channel k `counts` + k.
  void convert_all(std::uint32_t duration_us, std::int32_t counts = 1000) {
    for (std::uint32_t t = 0; t < duration_us; t += kPeriodUs) {
      for (std::uint8_t i = 0; i < 4; ++i)
        board.conversions.push_back({i, counts + i, board.now_us, 0, false});
      run(kPeriodUs);
      if (t % 1000000 == 0) send(link::TimeRequest{});
    }
  }
  std::vector<link::CellSample> of(std::uint8_t channel) {
    std::vector<link::CellSample> samples;
    for (const auto& sample : all<link::CellSample>()) {
      if (sample.channel == channel) samples.push_back(sample);
    }
    return samples;
  }
};

TEST_P(FirmwareCell, IsOffUntilConfiguredAndThenAsConfigured) {
  greet();
  convert(0, 5);
  EXPECT_TRUE(all<link::CellSample>().empty());
  link::Configure two = configuration();
  two.cell_count = 3;
  two.cells[0] = link::CellInput::b32;
  two.cells[1] = link::CellInput::off;
  two.cells[2] = link::CellInput::a64;
  two.cell_rate_sps = 10;
  ASSERT_EQ(ask(two), link::Result::ok);
  EXPECT_EQ(board.inputs[0], link::CellInput::b32);
  EXPECT_EQ(board.inputs[1], link::CellInput::off);
  EXPECT_EQ(board.inputs[2], link::CellInput::a64);
  EXPECT_EQ(board.inputs[3], link::CellInput::off);
  EXPECT_EQ(board.cell_rate_sps, 10);
}

TEST_P(FirmwareCell, DropsTheFirstConversionAfterConfiguration) {
  configure();
  convert(2, 111);
  EXPECT_TRUE(all<link::CellSample>().empty());
  const std::uint32_t ready_us = board.now_us;
  convert(2, -222);
  ASSERT_EQ(all<link::CellSample>().size(), 1u);
  const link::CellSample sample = all<link::CellSample>().front();
  EXPECT_EQ(sample.channel, 2);
  EXPECT_EQ(sample.counts, -222);
  EXPECT_EQ(sample.time_us, ready_us);
  EXPECT_EQ(sample.missed, 0);
  EXPECT_FALSE(sample.saturated);
}

TEST_P(FirmwareCell, NumbersConversionsOfEachChannelLostOnesIncluded) {
  configure();
  for (int i = 0; i < 3; ++i) convert(0, i);
  convert(1, 0);
  convert(1, 0);
  convert(0, 3, 2);
  convert(0, 4);
  std::vector<int> sequences;
  for (const auto& sample : of(0)) sequences.push_back(sample.sequence);
  EXPECT_EQ(sequences, (std::vector<int>{0, 1, 4, 5}));
  EXPECT_EQ(of(0).back().missed, 2);
  EXPECT_EQ(of(1).back().sequence, 0);
  EXPECT_EQ(of(1).back().missed, 0);
  run(1000000);
  EXPECT_EQ(all<link::Status>().back().dropped_reports, 2);
}

TEST_P(FirmwareCell, WaitsForRoomAndLosesNothingThatTheAmplifierStillHolds) {
  configure();
  convert(0, 1);
  board.room = 27;
  convert(0, 2);
  EXPECT_TRUE(all<link::CellSample>().empty());
  EXPECT_EQ(board.conversions.size(), 1u);
  board.room = 28;
  run(2 * kPollUs);
  ASSERT_EQ(all<link::CellSample>().size(), 1u);
  EXPECT_EQ(all<link::CellSample>().front().sequence, 0);
}

TEST_P(FirmwareCell, NumberWrapsAfter16Bits) {
  configure();
  convert(0, 0);
  for (int i = 0; i < 257; ++i) convert(0, 0, 254);
  convert(0, 0);
  // 258 samples and 257 * 254 lost.
  EXPECT_EQ(of(0).back().sequence, (257 * 255) % 65536);
  for (int i = 0; i < 2; ++i) convert(0, 0);
  EXPECT_EQ(of(0).back().sequence, (257 * 255 + 2) % 65536);
  EXPECT_EQ(of(0).back().missed, (257 * 254) % 65536);
}

TEST_P(FirmwareCell, IsSaturatedAtBothEndsOfItsRangeOnly) {
  configure();
  convert(3, 0);
  for (const std::int32_t counts : {0x7FFFFF, 0x7FFFFE, -0x800000, -0x7FFFFF}) convert(3, counts);
  std::vector<bool> saturated;
  for (const auto& sample : of(3)) saturated.push_back(sample.saturated);
  EXPECT_EQ(saturated, (std::vector<bool>{true, false, true, false}));
}

TEST_P(FirmwareCell, ThatIsNotWiredIsAFaultAndNotAZero) {
  configure();
  run(990000);
  EXPECT_TRUE(all<link::Fault>().empty());
  run(100000);
  ASSERT_EQ(all<link::Fault>().size(), 4u);
  unsigned channels = 0;
  for (const auto& fault : all<link::Fault>()) {
    EXPECT_EQ(fault.code, link::FaultCode::cell_silent);
    channels |= 1u << fault.channel;
  }
  EXPECT_EQ(channels, 15u);
  EXPECT_TRUE(all<link::CellSample>().empty());
  send(link::TimeRequest{});
  run(3000000);
  EXPECT_EQ(all<link::Fault>().size(), 4u);
}

TEST_P(FirmwareCell, ThatFallsSilentIsAFaultAndComesBackWithoutItsFirstConversion) {
  configure();
  convert_all(2000000);
  const std::size_t before = of(1).size();
  for (int i = 0; i < 150; ++i) {
    for (const std::uint8_t channel : {0, 2, 3}) convert(channel, 7);
    run(kPeriodUs - 6 * kPollUs);
  }
  ASSERT_EQ(all<link::Fault>().size(), 1u);
  EXPECT_EQ(last_fault().code, link::FaultCode::cell_silent);
  EXPECT_EQ(last_fault().channel, 1);
  EXPECT_EQ(of(1).size(), before);
  EXPECT_EQ(all<link::Status>().back().cell_rate_centihertz[1], 0);
  convert(1, 1);
  EXPECT_EQ(of(1).size(), before);
  convert(1, 2);
  ASSERT_EQ(of(1).size(), before + 1);
  EXPECT_EQ(of(1).back().counts, 2);
}

TEST_P(FirmwareCell, WhoseLineStaysLowIsStuckOnceAndItsCountsAreNotSent) {
  configure();
  for (int i = 0; i < 5; ++i) convert(2, 0, 0, true);
  ASSERT_EQ(all<link::Fault>().size(), 1u);
  EXPECT_EQ(last_fault().code, link::FaultCode::cell_stuck);
  EXPECT_EQ(last_fault().channel, 2);
  convert(2, 5);
  EXPECT_TRUE(of(2).empty());
  convert(2, 6);
  ASSERT_EQ(of(2).size(), 1u);
  EXPECT_EQ(of(2).front().counts, 6);
}

TEST_P(FirmwareCell, RateIsMeasured) {
  configure();
  convert_all(4000000);
  ASSERT_FALSE(all<link::Status>().empty());
  for (const std::uint16_t rate : all<link::Status>().back().cell_rate_centihertz)
    EXPECT_NEAR(rate, 8000, 1);
}

TEST_P(FirmwareCell, TareIsTheMeanOfTheConversionsThatWereAsked) {
  configure();
  convert_all(100000);
  ASSERT_EQ(ask(link::Tare{0b0101, 4}), link::Result::ok);
  for (const std::int32_t counts : {-8388608, -8388600, -8388601, -8388603}) convert(0, counts);
  for (const std::int32_t counts : {8388607, 8388606, 8388600, 8388605, 1, 2}) convert(2, counts);
  for (int i = 0; i < 8; ++i) convert(1, 5);
  ASSERT_EQ(all<link::TareResult>().size(), 2u);
  const link::TareResult low = all<link::TareResult>()[0];
  EXPECT_EQ(low.channel, 0);
  EXPECT_EQ(low.mean_counts, -8388603);
  EXPECT_EQ(low.spread_counts, 8u);
  EXPECT_EQ(low.conversions, 4);
  const link::TareResult high = all<link::TareResult>()[1];
  EXPECT_EQ(high.channel, 2);
  EXPECT_EQ(high.mean_counts, 8388605);  // of 8388604.5
  EXPECT_EQ(high.spread_counts, 7u);
}

TEST_P(FirmwareCell, TareOfAThousandDoesNotOverflow) {
  configure();
  convert_all(100000);
  for (const std::int32_t counts : {8388607, -8388608}) {
    ASSERT_EQ(ask(link::Tare{0b1000, 1000}), link::Result::ok);
    for (int i = 0; i < 1000; ++i) {
      convert(3, counts);
      send(link::TimeRequest{});
    }
    ASSERT_FALSE(all<link::TareResult>().empty());
    EXPECT_EQ(all<link::TareResult>().back().mean_counts, counts);
    EXPECT_EQ(all<link::TareResult>().back().conversions, 1000);
  }
}

TEST_P(FirmwareCell, TareIsRefusedWhereNothingIsConverted) {
  greet();
  EXPECT_EQ(ask(link::Tare{1, 10}), link::Result::not_ready);
  link::Configure one = configuration();
  one.cell_count = 1;
  ASSERT_EQ(ask(one), link::Result::ok);
  EXPECT_EQ(ask(link::Tare{3, 10}), link::Result::not_ready);
  EXPECT_EQ(ask(link::Tare{1, 10}), link::Result::ok);
  run(1100000);
  EXPECT_EQ(ask(link::Tare{1, 10}), link::Result::not_ready) << "it is silent";
  EXPECT_EQ(ask(link::Tare{0, 10}), link::Result::out_of_range);
  EXPECT_EQ(ask(link::Tare{16, 10}), link::Result::out_of_range);
  EXPECT_EQ(ask(link::Tare{1, 0}), link::Result::out_of_range);
  EXPECT_EQ(ask(link::Tare{1, 1001}), link::Result::out_of_range);
  EXPECT_TRUE(all<link::TareResult>().empty());
}

INSTANTIATE_TEST_SUITE_P(Clock, FirmwareCell, kClockStarts);

}  // namespace
}  // namespace tagwrench::firmware
