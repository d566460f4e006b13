// Who the board is, versions, configuration, identity, status.
#include <gmock/gmock.h>

#include "tests/unit/firmware/firmware_test.h"

namespace tagwrench::firmware {
namespace {

class FirmwareApp : public Firmware {};

TEST_P(FirmwareApp, SaysWhoItIsAndWhatItHas) {
  board.boot_id = 99;
  board.reset_cause = link::ResetCause::watchdog;
  greet();
  run(5000);
  ASSERT_EQ(all<link::Hello>().size(), 1u);
  const link::Hello hello = all<link::Hello>().front();
  EXPECT_EQ(hello.protocol_major, link::kProtocolMajor);
  EXPECT_EQ(hello.protocol_minor, link::kProtocolMinor);
  EXPECT_STREQ(hello.board, "fake");
  EXPECT_STREQ(hello.firmware, TAGWRENCH_VERSION);
  EXPECT_EQ(hello.boot_id, 99u);
  EXPECT_EQ(hello.reset_cause, link::ResetCause::watchdog);
  EXPECT_EQ(hello.session, 0x5E55u);
  ASSERT_EQ(all<link::Capabilities>().size(), 1u);
  const link::Capabilities has = all<link::Capabilities>().front();
  EXPECT_EQ(has.cells, 4);
  EXPECT_EQ(has.led_sustained_permille, kSustainedPermille);
  EXPECT_EQ(has.led_full_time_ms, kFullTimeMs);
  EXPECT_EQ(has.strobe_period_max_us, 1000000u);
  EXPECT_TRUE(all<link::Answer>().empty());
}

TEST_P(FirmwareApp, IsQuietUntilItIsGreeted) {
  run(10000000);
  EXPECT_TRUE(frame_sequences.empty());
}

TEST_P(FirmwareApp, AHostOfAnotherMajorIsToldBothVersionsAndRefused) {
  greet();
  ASSERT_EQ(ask(steady(50)), link::Result::ok);
  all<link::Hello>().clear();
  all<link::Capabilities>().clear();
  const link::HelloRequest foreign{link::kProtocolMajor + 1, 0, 0xABC};
  EXPECT_EQ(ask(foreign), link::Result::wrong_version);
  ASSERT_EQ(all<link::Hello>().size(), 1u);
  EXPECT_EQ(all<link::Hello>().front().protocol_major, link::kProtocolMajor);
  EXPECT_EQ(all<link::Hello>().front().session, 0xABCu);
  EXPECT_TRUE(all<link::Capabilities>().empty());
  EXPECT_TRUE(board.dark());
  EXPECT_EQ(ask(steady(50)), link::Result::wrong_version);
  EXPECT_EQ(ask(link::TimeRequest{}), link::Result::wrong_version);
  EXPECT_TRUE(board.dark());
  greet();
  EXPECT_EQ(ask(steady(50)), link::Result::ok);
}

TEST_P(FirmwareApp, AHostOfAnotherMinorIsServed) {
  send(link::HelloRequest{link::kProtocolMajor, link::kProtocolMinor + 3, 1});
  run(5000);
  EXPECT_EQ(all<link::Capabilities>().size(), 1u);
  EXPECT_EQ(ask(steady(50)), link::Result::ok);
}

TEST_P(FirmwareApp, AConfigurationOutOfRangeIsRefusedWhole) {
  greet();
  link::Configure good = configuration();
  good.cells[1] = link::CellInput::off;
  ASSERT_EQ(ask(good), link::Result::ok);
  const auto change = [](auto member, auto value) {
    link::Configure wrong = configuration();
    wrong.*member = static_cast<std::remove_reference_t<decltype(wrong.*member)>>(value);
    return wrong;
  };
  for (const link::Configure& wrong :
       {change(&link::Configure::host_timeout_ms, 199),
        change(&link::Configure::host_timeout_ms, 60001),
        change(&link::Configure::cell_rate_sps, 0), change(&link::Configure::cell_rate_sps, 40),
        change(&link::Configure::adc_mask, 4), change(&link::Configure::adc_rate_hz, 0),
        change(&link::Configure::adc_rate_hz, 201), change(&link::Configure::status_period_ms, 99),
        change(&link::Configure::status_period_ms, 60001)}) {
    EXPECT_EQ(ask(wrong), link::Result::out_of_range);
    EXPECT_EQ(board.inputs[1], link::CellInput::off);
    EXPECT_EQ(board.cell_rate_sps, 80);
    EXPECT_EQ(board.adc_mask, 3);
  }
  for (const link::Configure& right :
       {change(&link::Configure::host_timeout_ms, 200),
        change(&link::Configure::host_timeout_ms, 60000), change(&link::Configure::adc_rate_hz, 1),
        change(&link::Configure::adc_rate_hz, 200),
        change(&link::Configure::status_period_ms, 100)})
    EXPECT_EQ(ask(right), link::Result::ok);
}

TEST_P(FirmwareApp, NeedsNoRateForWhatIsOff) {
  greet();
  link::Configure nothing{};
  nothing.host_timeout_ms = 1000;
  nothing.status_period_ms = 1000;
  EXPECT_EQ(ask(nothing), link::Result::ok);
}

TEST_P(FirmwareApp, AnIdIsGivenOnce) {
  greet();
  EXPECT_EQ(all<link::Hello>().back().unique_id.count, 0);
  EXPECT_EQ(ask(link::SetId{}), link::Result::out_of_range);
  EXPECT_EQ(ask(link::SetId{{{1, 2, 3, 4, 5, 6, 7, 8}, 8}}), link::Result::ok);
  EXPECT_EQ(ask(link::SetId{{{9, 9}, 2}}), link::Result::already_set);
  greet();
  EXPECT_EQ(all<link::Hello>().back().unique_id.count, 8);
  EXPECT_THAT(all<link::Hello>().back().unique_id.bytes,
              testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST_P(FirmwareApp, StatusComesAtItsPeriodAndSaysWhatIsGoingOn) {
  greet();
  link::Configure often = configuration();
  often.status_period_ms = 100;
  ASSERT_EQ(ask(often), link::Result::ok);
  ASSERT_EQ(ask(steady(250)), link::Result::ok);
  board.overruns = 3;
  run(2000000);
  EXPECT_NEAR(static_cast<double>(all<link::Status>().size()), 20, 1);
  const link::Status status = all<link::Status>().back();
  EXPECT_EQ(status.session, 0x5E55u);
  EXPECT_EQ(status.led_level_permille, 250);
  EXPECT_EQ(status.overruns, 3);
  EXPECT_EQ(status.supply_mv, 5000);
  EXPECT_EQ(status.cell_count, 4);
  EXPECT_EQ(status.led_on_time_s, 1u);
  EXPECT_LT(board.now_us - status.time_us, 100000u + kPollUs);
}

TEST_P(FirmwareApp, TellsTheLongestTurnOfItsLoop) {
  greet();
  board.advance(4321 - kPollUs);
  run(2000000);
  EXPECT_EQ(all<link::Status>().back().longest_loop_us, 4321u);
}

TEST_P(FirmwareApp, ALowSupplyIsAFaultOnceAndAgainAfterItWasGood) {
  greet();
  board.supply_mv = 4150;
  run(3000000);
  ASSERT_EQ(all<link::Fault>().size(), 1u);
  EXPECT_EQ(last_fault().code, link::FaultCode::supply_low);
  for (const std::uint16_t supply_mv : {4250, 4150, 5000}) {
    board.supply_mv = supply_mv;
    run_alive(2000000);
    EXPECT_EQ(all<link::Fault>().size(), 1u);
  }
  board.supply_mv = 4150;
  run_alive(2000000);
  EXPECT_EQ(all<link::Fault>().size(), 2u);
}

TEST_P(FirmwareApp, TheLampBlinksWhileThereIsNoHostAndIsSteadyWithOne) {
  int changes = 0;
  bool before = board.host_lamp;
  const auto watch = [&](std::uint32_t duration_us) {
    changes = 0;
    for (std::uint32_t t = 0; t < duration_us; t += 10000) {
      run(10000);
      changes += board.host_lamp != before ? 1 : 0;
      before = board.host_lamp;
    }
  };
  watch(10000000);
  EXPECT_NEAR(changes, 10, 2);
  greet();
  watch(4000000);
  EXPECT_TRUE(board.host_lamp);
  EXPECT_LE(changes, 1);
}

INSTANTIATE_TEST_SUITE_P(Clock, FirmwareApp, kClockStarts);

}  // namespace
}  // namespace tagwrench::firmware
