// The LED: when it shines, how brightly, and above all when it does not.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <utility>

#include "protocol/pattern.h"
#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

double us_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-3; }

link::Led steady(std::uint16_t permille) {
  link::Led led{};
  led.mode = permille == 0 ? link::LedMode::off : link::LedMode::steady;
  led.level_permille = permille;
  return led;
}

struct LedTest : testing::Test {
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF};
  BoardClient client{board};

  void SetUp() override { ASSERT_TRUE(client.greet()); }
  void TearDown() override {
    EXPECT_EQ(board.gate_conflicts(), 0U) << "both pins drove the gate against each other";
  }

  /// Keeps the host heard while time goes on.
  void run_heard(VirtualTime duration) {
    const VirtualTime end = board.now() + duration;
    while (board.now() < end) {
      client.send(link::TimeRequest{});
      client.run(std::min<VirtualTime>(milliseconds(100), end - board.now()));
    }
  }
  std::uint32_t board_us(VirtualTime from_now) {
    return static_cast<std::uint32_t>(board.board_us() + us_of(from_now));
  }
  std::size_t faults(link::FaultCode code) {
    std::size_t count = 0;
    for (const auto& fault : client.all<link::Fault>()) count += fault.message.code == code ? 1 : 0;
    return count;
  }
};

TEST_F(LedTest, IsOffFromResetUntilCommanded) {
  run_heard(seconds(1));
  EXPECT_EQ(board.led().all().size(), 1U) << "not even a spike";
  EXPECT_EQ(board.led().level(), 0);
}

TEST_F(LedTest, ShinesAtTheLevelThatIsAsked) {
  for (const std::uint16_t permille : {1, 4, 50, 137, 300, 0}) {
    ASSERT_EQ(client.ask(steady(permille)), link::Result::ok);
    EXPECT_NEAR(1000 * board.led().level(), permille, permille == 0 ? 0 : 2.5) << "permille";
  }
  EXPECT_EQ(board.led().level(), 0) << "exactly dark, without the PWM's spike";
}

TEST_F(LedTest, ALevelBeyondTheLimitIsRefused) {
  ASSERT_EQ(client.ask(steady(200)), link::Result::ok);
  const double before = board.led().level();
  EXPECT_EQ(client.ask(steady(1001)), link::Result::out_of_range);
  EXPECT_EQ(client.ask(steady(60000)), link::Result::out_of_range);
  EXPECT_EQ(board.led().level(), before);
}

TEST_F(LedTest, GoesOffAfterFiveSecondsOfSilence) {
  ASSERT_EQ(client.ask(steady(250)), link::Result::ok);
  const VirtualTime heard = client.all<link::Answer>().back().end;
  client.run(milliseconds(4950));
  EXPECT_GT(board.led().level(), 0.2);
  client.run(milliseconds(200));
  EXPECT_EQ(board.led().level(), 0);
  EXPECT_NEAR(us_of(board.led().all().back().time - heard), 5e6, 0.03e6);
  EXPECT_EQ(faults(link::FaultCode::host_silent), 1U);
  // It stays off when the host comes back.
  ASSERT_TRUE(client.greet());
  client.run(milliseconds(100));
  EXPECT_EQ(board.led().level(), 0);
}

TEST_F(LedTest, GoesOffAfterTheConfiguredSilence) {
  link::Configure configuration = full_configuration();
  configuration.host_timeout_ms = 400;
  ASSERT_EQ(client.ask(configuration), link::Result::ok);
  ASSERT_EQ(client.ask(steady(250)), link::Result::ok);
  const VirtualTime heard = client.all<link::Answer>().back().end;
  run_heard(seconds(2));
  EXPECT_GT(board.led().level(), 0.2) << "any valid frame is a sign of life";
  const VirtualTime silent_from = board.now();
  client.run(milliseconds(600));
  EXPECT_EQ(board.led().level(), 0);
  EXPECT_GT(board.led().all().back().time, heard + seconds(2));
  EXPECT_LT(us_of(board.led().all().back().time - silent_from), 420e3);
}

TEST_F(LedTest, PulsesEndWithTheHostToo) {
  link::Configure configuration = full_configuration();
  configuration.host_timeout_ms = 300;
  ASSERT_EQ(client.ask(configuration), link::Result::ok);
  for (const link::LedMode mode : {link::LedMode::strobe, link::LedMode::pattern}) {
    link::Led pulses{};
    pulses.mode = mode;
    pulses.period_us = 4000;
    pulses.width_us = 1000;
    pulses.pattern_seed = 77;
    pulses.start_us = board_us(milliseconds(10));
    ASSERT_EQ(client.ask(pulses), link::Result::ok);
    const VirtualTime heard = client.all<link::Answer>().back().end;
    client.run(milliseconds(290));
    EXPECT_GT(board.led().mean(board.now() - milliseconds(50), board.now()), 0.1);
    client.run(milliseconds(200));
    EXPECT_EQ(board.led().mean(heard + milliseconds(310), board.now()), 0);
    EXPECT_EQ(board.led().level(), 0);
  }
}

TEST_F(LedTest, ASilenceBeyondTheLimitsIsRefused) {
  link::Configure configuration = full_configuration();
  for (const std::uint16_t timeout_ms : {0, 199, 60001}) {
    configuration.host_timeout_ms = timeout_ms;
    EXPECT_EQ(client.ask(configuration), link::Result::out_of_range) << timeout_ms << " ms";
  }
}

TEST_F(LedTest, DamagedFramesAreNoSignOfLife) {
  link::Configure configuration = full_configuration();
  configuration.host_timeout_ms = 400;
  ASSERT_EQ(client.ask(configuration), link::Result::ok);
  ASSERT_EQ(client.ask(steady(250)), link::Result::ok);
  const std::uint8_t noise[] = {3, 4, 1, 9, 9, 9, 0};
  for (int i = 0; i < 60; ++i) {
    board.write(noise);
    client.run(milliseconds(10));
  }
  EXPECT_EQ(board.led().level(), 0);
}

TEST_F(LedTest, AHangPutsItOutWithin300MsAndIsReported) {
  for (const bool interrupts_off : {false, true}) {
    ASSERT_EQ(client.ask(steady(300)), link::Result::ok);
    client.run(milliseconds(37));
    ASSERT_GT(board.led().level(), 0.25);
    const VirtualTime hung = board.now();
    board.hang(interrupts_off);
    client.run(milliseconds(310));
    EXPECT_EQ(board.led().level(), 0);
    EXPECT_LT(us_of(board.led().all().back().time - hung), 300e3);
    const auto hello = client.greet();
    ASSERT_TRUE(hello);
    EXPECT_EQ(hello->reset_cause, link::ResetCause::watchdog);
    EXPECT_EQ(board.led().level(), 0) << "nor does it come back";
  }
}

TEST_F(LedTest, AHangBetweenPulsesLightsForTheWatchdogsTimeAtMost) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = 20000;
  strobe.width_us = 8000;
  strobe.start_us = board_us(milliseconds(20));
  ASSERT_EQ(client.ask(strobe), link::Result::ok);
  run_heard(milliseconds(500));
  // Dark, with the next pulse's begin already in the hands of the hardware.
  while (board.led().level() == 0) board.advance_by(microseconds(100));
  while (board.led().level() > 0) board.advance_by(microseconds(100));
  board.advance_by(milliseconds(5));
  board.hang(true);
  const VirtualTime hung = board.now();
  client.run(milliseconds(100));
  EXPECT_GT(board.led().level(), 0) << "nobody ends the pulse";
  client.run(milliseconds(300));
  EXPECT_EQ(board.led().level(), 0);
  EXPECT_LT(us_of(board.led().all().back().time - hung), 300e3);
}

TEST_F(LedTest, FullLightIsLimitedAfterTenSecondsAndSaid) {
  ASSERT_EQ(client.ask(steady(1000)), link::Result::ok);
  const VirtualTime on = board.now();
  run_heard(milliseconds(9800));
  EXPECT_GT(board.led().level(), 0.99);
  EXPECT_EQ(faults(link::FaultCode::led_limited), 0U);
  run_heard(milliseconds(400));
  EXPECT_NEAR(board.led().level(), 0.3, 0.005);
  EXPECT_EQ(faults(link::FaultCode::led_limited), 1U);
  EXPECT_NEAR(us_of(board.led().all().back().time - on), 10e6, 0.1e6);
  run_heard(seconds(3));
  EXPECT_NEAR(board.led().level(), 0.3, 0.005) << "for as long as the host asks for more";
  EXPECT_TRUE(client.all<link::Status>().back().message.led_limited);
}

TEST_F(LedTest, OffAndOnAgainDoesNotCheatTheLimit) {
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(client.ask(steady(1000)), link::Result::ok);
    run_heard(seconds(4));
    ASSERT_EQ(client.ask(steady(0)), link::Result::ok);
    run_heard(milliseconds(50));
  }
  const double mean = board.led().mean(board.now() - seconds(20), board.now());
  // 10 s at 1000 permille from cold, what cools in the pauses, and 300 permille for ever.
  EXPECT_LT(mean, (10 * 0.7 + 20 * 0.3) / 20 + 0.02);
}

TEST_F(LedTest, TheSustainedLevelIsNeverLimited) {
  ASSERT_EQ(client.ask(steady(300)), link::Result::ok);
  run_heard(seconds(25));
  EXPECT_NEAR(board.led().level(), 0.3, 0.004);
  EXPECT_EQ(faults(link::FaultCode::led_limited), 0U);
}

struct Strobe {
  std::uint32_t period_us;
  std::uint16_t width_us;
};

struct StrobeTest : LedTest, testing::WithParamInterface<Strobe> {};

TEST_P(StrobeTest, PulsesAreWhereAndAsLongAsAsked) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = GetParam().period_us;
  strobe.width_us = GetParam().width_us;
  strobe.start_us = board_us(milliseconds(30));
  ASSERT_EQ(client.ask(full_configuration()), link::Result::ok);
  ASSERT_EQ(client.ask(strobe), link::Result::ok);
  const VirtualTime start = board.true_time(strobe.start_us);
  const VirtualTime begin = board.now();
  run_heard(seconds(3));
  const auto pulses = board.led().pulses(begin, board.now());
  const double expected = us_of(board.now() - start) / strobe.period_us;
  EXPECT_NEAR(static_cast<double>(pulses.size()), expected, 1.01);
  double worst_width = 0;
  double worst_phase = 0;
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    worst_width =
        std::max(worst_width, std::abs(us_of(pulses[i].end - pulses[i].begin) - strobe.width_us));
    const double due = us_of(start) + static_cast<double>(i) * strobe.period_us;
    worst_phase = std::max(worst_phase, std::abs(us_of(pulses[i].begin) - due));
  }
  fmt::print("  {} pulses: width within {:.2f} us, begin within {:.2f} us\n", pulses.size(),
             worst_width, worst_phase);
  EXPECT_LE(worst_width, 1.0) << "us";
  EXPECT_LE(worst_phase, 1.0) << "us";
}

INSTANTIATE_TEST_SUITE_P(OfCameras, StrobeTest,
                         testing::Values(Strobe{40000, 500}, Strobe{33333, 2000},
                                         Strobe{16667, 150}, Strobe{4000, 1000},
                                         Strobe{500000, 20000}));

TEST_F(LedTest, AStrobeThatBeganInThePastIsInPhase) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = 33333;
  strobe.width_us = 1000;
  strobe.start_us = board_us(VirtualTime(0)) - 2000000;
  ASSERT_EQ(client.ask(strobe), link::Result::ok);
  const VirtualTime begin = board.now();
  run_heard(seconds(1));
  const auto pulses = board.led().pulses(begin, board.now());
  ASSERT_GE(pulses.size(), 28U);
  for (const LedPulse& pulse : pulses) {
    const double since =
        us_of(pulse.begin - board.clock_zero()) - static_cast<std::int32_t>(strobe.start_us);
    const double phase = since - strobe.period_us * std::round(since / strobe.period_us);
    EXPECT_NEAR(phase, 0, 1.0) << "us";
  }
}

TEST_F(LedTest, AStrobeBeyondTheLimitsIsRefused) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  const auto refused = [&](std::uint32_t period_us, std::uint16_t width_us) {
    strobe.period_us = period_us;
    strobe.width_us = width_us;
    return client.ask(strobe) == link::Result::out_of_range;
  };
  EXPECT_TRUE(refused(40000, 10));
  EXPECT_TRUE(refused(40000, 30000));
  EXPECT_TRUE(refused(100, 50));
  EXPECT_TRUE(refused(2000000, 1000));
  EXPECT_TRUE(refused(10000, 10000)) << "never dark";
  EXPECT_EQ(board.led().all().size(), 1U);
}

TEST_F(LedTest, ThePatternIsThatOfTheProtocol) {
  link::Led pattern{};
  pattern.mode = link::LedMode::pattern;
  pattern.period_us = 5000;
  pattern.start_us = board_us(milliseconds(40));
  pattern.pattern_seed = 0x2B5C;
  ASSERT_EQ(client.ask(full_configuration()), link::Result::ok);
  ASSERT_EQ(client.ask(pattern), link::Result::ok);
  run_heard(seconds(4));
  std::uint16_t state = pattern.pattern_seed;
  const VirtualTime start = board.true_time(pattern.start_us);
  double worst_us = 0;
  int bits = 0;
  for (VirtualTime bit = start; bit + microseconds(5000) < board.now();
       bit += microseconds(5000), ++bits) {
    const double expected = link::pattern_light(state) ? 1 : 0;
    ASSERT_EQ(board.led().mean(bit + microseconds(3), bit + microseconds(4997)), expected)
        << "bit " << bits;
    state = link::next_pattern_state(state);
  }
  for (const LedChange& change : board.led().changes(start, board.now())) {
    const double since = us_of(change.time - start) / 5000;
    worst_us = std::max(worst_us, 5000 * std::abs(since - std::round(since)));
  }
  fmt::print("  {} bits, edges within {:.2f} us\n", bits, worst_us);
  EXPECT_GT(bits, 750);
  EXPECT_LE(worst_us, 1.0);
}

TEST_F(LedTest, PulsesOverTheSustainedLevelAreLimitedToo) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = 20000;
  strobe.width_us = 18000;
  strobe.start_us = board_us(milliseconds(20));
  ASSERT_EQ(client.ask(strobe), link::Result::ok);
  run_heard(seconds(20));
  EXPECT_EQ(faults(link::FaultCode::led_limited), 1U);
  EXPECT_LE(board.led().mean(board.now() - seconds(2), board.now()), 0.31);
  EXPECT_GE(board.led().mean(board.now() - seconds(2), board.now()), 0.25);
}

/// Compare A makes the pulses, compare B of the same timer the conversions.
TEST_F(LedTest, PulsesDelayNoVoltageSample) {
  ASSERT_EQ(client.ask(full_configuration()), link::Result::ok);
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  for (const auto& [period_us, width_us] : {std::pair(2000, 1000), {2000, 600}, {40000, 600}}) {
    strobe.period_us = static_cast<std::uint32_t>(period_us);
    strobe.width_us = static_cast<std::uint16_t>(width_us);
    strobe.start_us = board_us(milliseconds(20));
    ASSERT_EQ(client.ask(strobe), link::Result::ok);
    client.forget();
    run_heard(seconds(15));
    std::array<std::optional<std::uint32_t>, 2> before;
    int samples = 0;
    for (const auto& sample : client.all<link::AdcSample>()) {
      auto& last = before.at(sample.message.channel);
      if (last) {
        ASSERT_NEAR(sample.message.time_us - *last, 10000, 10)
            << "us, at " << sample.message.time_us * 1e-6 << " s, pulses of " << width_us
            << " us every " << period_us << " us";
      }
      last = sample.message.time_us;
      ++samples;
    }
    EXPECT_GE(samples, 2990);
  }
}

TEST_F(LedTest, FromPulsesToSteadyAndOffLeavesNoLight) {
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = 10000;
  strobe.width_us = 2000;
  strobe.start_us = board_us(milliseconds(10));
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(client.ask(strobe), link::Result::ok);
    client.run(milliseconds(33 + i));
    ASSERT_EQ(client.ask(steady(100)), link::Result::ok);
    EXPECT_NEAR(board.led().level(), 0.1, 0.004);
    client.run(milliseconds(21));
    EXPECT_NEAR(board.led().level(), 0.1, 0.004);
    ASSERT_EQ(client.ask(steady(0)), link::Result::ok);
    const VirtualTime off = board.now();
    client.run(milliseconds(50));
    EXPECT_EQ(board.led().mean(off, board.now()), 0);
  }
}

}  // namespace
}  // namespace tagwrench::emulator
