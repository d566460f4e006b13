// The light: what it does when told to, and when it goes off by itself.
#include "protocol/pattern.h"
#include "tests/unit/firmware/firmware_test.h"

namespace tagwrench::firmware {
namespace {

class FirmwareLed : public Firmware {
 protected:
  static link::Led strobe(std::uint32_t period_us, std::uint16_t width_us, std::uint32_t start_us) {
    link::Led led{};
    led.mode = link::LedMode::strobe;
    led.period_us = period_us;
    led.width_us = width_us;
    led.start_us = start_us;
    return led;
  }
  static link::Led pattern(std::uint32_t period_us, std::uint16_t seed, std::uint32_t start_us) {
    link::Led led{};
    led.mode = link::LedMode::pattern;
    led.period_us = period_us;
    led.pattern_seed = seed;
    led.start_us = start_us;
    return led;
  }
  /// Was there light at this time?
  bool light_at(std::uint32_t time_us) const {
    bool on = false;
    for (const auto& edge : board.light) {
      if (static_cast<std::int32_t>(time_us - edge.at_us) >= 0) on = edge.on;
    }
    return on;
  }
  /// Each pulse begins at start + n * period, without a gap in n, and lasts `width`.
  void expect_pulses(std::uint32_t period_us, std::uint32_t width_us, std::uint32_t start_us) {
    ASSERT_GE(board.light.size(), 4u);
    for (std::size_t i = 0; i + 1 < board.light.size(); i += 2) {
      ASSERT_TRUE(board.light[i].on);
      ASSERT_FALSE(board.light[i + 1].on);
      ASSERT_EQ((board.light[i].at_us - start_us) % period_us, 0u) << i;
      ASSERT_EQ(board.light[i + 1].at_us - board.light[i].at_us, width_us) << i;
      if (i > 0) {
        ASSERT_EQ(board.light[i].at_us - board.light[i - 2].at_us, period_us) << i;
      }
    }
    EXPECT_EQ(board.late_edges, 0u);
  }
  /// The whole bits between two times are those of the pattern.
  void expect_bits(std::uint32_t period_us, std::uint16_t seed, std::uint32_t start_us,
                   std::uint32_t from_us, std::uint32_t to_us) {
    std::uint16_t state = seed;
    int checked = 0;
    for (std::uint32_t bit_us = start_us; to_us - bit_us < 0x80000000u;
         bit_us += period_us, state = link::next_pattern_state(state)) {
      if (bit_us - from_us >= 0x80000000u) continue;
      ASSERT_EQ(light_at(bit_us + period_us / 4), link::pattern_light(state)) << checked;
      ++checked;
    }
    EXPECT_GT(checked, 50);
  }
};

TEST_P(FirmwareLed, IsDarkUntilAHostWantsLight) {
  run(100000);
  EXPECT_TRUE(board.dark());
  greet();
  EXPECT_TRUE(board.dark());
  EXPECT_EQ(ask(steady(250)), link::Result::ok);
  EXPECT_EQ(board.steady_permille, 250);
}

TEST_P(FirmwareLed, GoesOffWhenTheHostIsSilentForFiveSeconds) {
  greet();
  ASSERT_EQ(ask(steady(200)), link::Result::ok);
  const std::uint32_t last_us = board.now_us;
  run(4900000);
  EXPECT_EQ(board.steady_permille, 200);
  run(200000);
  EXPECT_TRUE(board.dark());
  ASSERT_EQ(all<link::Fault>().size(), 1u);
  EXPECT_EQ(last_fault().code, link::FaultCode::host_silent);
  EXPECT_NEAR(static_cast<double>(last_fault().time_us - last_us), 5e6, 6000);
  run(20000000);
  EXPECT_EQ(all<link::Fault>().size(), 1u);
}

TEST_P(FirmwareLed, GoesOffAfterTheTimeThatWasConfigured) {
  greet();
  link::Configure quick = configuration();
  quick.host_timeout_ms = 300;
  ASSERT_EQ(ask(quick), link::Result::ok);
  ASSERT_EQ(ask(strobe(10000, 500, 0)), link::Result::ok);
  run_alive(2000000);
  EXPECT_FALSE(board.dark());
  run(320000);
  EXPECT_TRUE(board.dark());
}

TEST_P(FirmwareLed, StaysOnForAnyValidFrameButNotForNoise) {
  greet();
  ASSERT_EQ(ask(steady(200)), link::Result::ok);
  for (int i = 0; i < 10; ++i) {
    send_raw({0x7E, 0});
    run(1000000);
  }
  EXPECT_EQ(board.steady_permille, 200);
  for (int i = 0; i < 6; ++i) {
    for (const std::uint8_t byte : {3, 1, 2, 0}) board.incoming.push_back({byte, board.now_us});
    run(1000000);
  }
  EXPECT_TRUE(board.dark());
}

TEST_P(FirmwareLed, BearsTheSustainedLevelForEver) {
  greet();
  ASSERT_EQ(ask(steady(kSustainedPermille)), link::Result::ok);
  run_alive(600000000);
  EXPECT_EQ(board.steady_permille, kSustainedPermille);
  EXPECT_TRUE(all<link::Fault>().empty());
  EXPECT_NEAR(all<link::Status>().back().led_on_time_s, 600, 2);
}

TEST_P(FirmwareLed, IsLoweredAfterTenSecondsOfFullLight) {
  greet();
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(9900000);
  EXPECT_EQ(board.steady_permille, 1000);
  run_alive(200000);
  EXPECT_EQ(board.steady_permille, kSustainedPermille);
  EXPECT_EQ(last_fault().code, link::FaultCode::led_limited);
  // Wanting it again does not help, and is no new fault.
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(20000000);
  EXPECT_EQ(board.steady_permille, kSustainedPermille);
  EXPECT_EQ(all<link::Fault>().size(), 1u);
  EXPECT_TRUE(all<link::Status>().back().led_limited);
  EXPECT_EQ(all<link::Status>().back().led_level_permille, kSustainedPermille);
}

TEST_P(FirmwareLed, GetsItsTenSecondsBackWhenItHasCooled) {
  greet();
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(12000000);
  ASSERT_EQ(ask(steady(0)), link::Result::ok);
  run_alive(23400000);
  EXPECT_FALSE(all<link::Status>().back().led_limited);
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(9900000);
  EXPECT_EQ(board.steady_permille, 1000);
  run_alive(200000);
  EXPECT_EQ(board.steady_permille, kSustainedPermille);
}

TEST_P(FirmwareLed, StrobesWithThePeriodWidthAndPhaseThatWereAsked) {
  greet();
  // Of a time past, of one ahead, and of one long past.
  for (const std::uint32_t start_us :
       {board.now_us - 123456, board.now_us + 1000000, board.now_us - 3000000000u}) {
    board.light.clear();
    ASSERT_EQ(ask(strobe(33333, 700, start_us)), link::Result::ok);
    run_alive(2000000);
    // What was cut by the command before is not of this strobe.
    while (!board.light.empty() && !board.light.front().on) board.light.erase(board.light.begin());
    expect_pulses(33333, 700, start_us);
  }
}

TEST_P(FirmwareLed, StrobeBeginsAtAStartAheadAndNotBefore) {
  greet();
  const std::uint32_t start_us = board.now_us + 700000;
  ASSERT_EQ(ask(strobe(10000, 500, start_us)), link::Result::ok);
  run_alive(1500000);
  ASSERT_FALSE(board.light.empty());
  EXPECT_EQ(board.light.front().at_us, start_us);
}

TEST_P(FirmwareLed, EdgesAreInTimeWhenTheLoopTakesItsLongest) {
  greet();
  ASSERT_EQ(ask(strobe(2000, 100, board.now_us)), link::Result::ok);
  board.light.clear();
  for (int i = 0; i < 400; ++i) {
    board.advance(4500);
    run(kPollUs);
  }
  for (std::size_t i = 0; i + 2 < board.light.size(); i += 2) {
    ASSERT_EQ(board.light[i + 2].at_us - board.light[i].at_us, 2000u) << i;
  }
  EXPECT_EQ(board.late_edges, 0u);
}

TEST_P(FirmwareLed, AStrobeIsShortenedToTheSustainedLevelWhenItGetsTooHot) {
  greet();
  const std::uint32_t start_us = board.now_us;
  ASSERT_EQ(ask(strobe(25000, 20000, start_us)), link::Result::ok);
  // Of 800 permille, 500 too much: 7000 permille s are full after 14 s.
  run_alive(13900000);
  EXPECT_TRUE(all<link::Fault>().empty());
  run_alive(500000);
  EXPECT_EQ(last_fault().code, link::FaultCode::led_limited);
  board.light.clear();
  run_alive(1000000);
  while (!board.light.front().on) board.light.erase(board.light.begin());
  expect_pulses(25000, 7500, start_us);
}

TEST_P(FirmwareLed, PatternIsTheOneThatBothSidesKnow) {
  greet();
  const std::uint32_t start_us = board.now_us + 50000;
  ASSERT_EQ(ask(pattern(4000, 77, start_us)), link::Result::ok);
  run_alive(2000000);
  expect_bits(4000, 77, start_us, start_us, board.now_us - 4000);
  EXPECT_EQ(board.light.front().at_us % 4000, start_us % 4000);
  EXPECT_EQ(board.late_edges, 0u);
}

TEST_P(FirmwareLed, RepeatingAnOrderAsASignOfLifeDisturbsNoPulse) {
  greet();
  const std::uint32_t start_us = board.now_us + 50000;
  ASSERT_EQ(ask(pattern(4000, 77, start_us)), link::Result::ok);
  for (int i = 0; i < 20; ++i) {
    run(97300);
    ASSERT_EQ(ask(pattern(4000, 77, start_us)), link::Result::ok);
  }
  expect_bits(4000, 77, start_us, start_us, board.now_us - 4000);

  board.light.clear();
  const std::uint32_t again_us = board.now_us + 50000;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(ask(strobe(25000, 5000, again_us)), link::Result::ok);
    run(97300);
  }
  while (!board.light.front().on || board.light.front().at_us - again_us >= 0x80000000u)
    board.light.erase(board.light.begin());
  expect_pulses(25000, 5000, again_us);
}

TEST_P(FirmwareLed, OrdersThatBeginTheirPulsesAnewGetNoMoreLightThanSteadyOnesDo) {
  greet();
  // 2 % of light, if it were not begun again and again.
  std::uint32_t lit_us = 0;
  const auto abuse = [&](std::uint32_t duration_us) {
    for (std::uint32_t t = 0; t < duration_us; t += 22000) {
      send(strobe(1000000, 20000, board.now_us + 2500));
      for (int i = 0; i < 44; ++i) {
        run(500);
        if (board.shining) lit_us += 500;
      }
    }
  };
  abuse(20000000);
  EXPECT_EQ(last_fault().code, link::FaultCode::led_limited);
  lit_us = 0;
  abuse(20000000);
  EXPECT_NEAR(lit_us, 0.3 * 20e6, 0.03 * 20e6);
}

TEST_P(FirmwareLed, HeatOutlivesAReset) {
  greet();
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(11000000);
  EXPECT_EQ(board.steady_permille, 300);
  restart();
  greet();
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  run_alive(100000);
  EXPECT_EQ(board.steady_permille, 300) << "still hot";
  ASSERT_EQ(ask(steady(0)), link::Result::ok);
  run_alive(13000000);
  ASSERT_EQ(ask(steady(1000)), link::Result::ok);
  EXPECT_EQ(board.steady_permille, 1000) << "cool enough after a dark while";
}

TEST_P(FirmwareLed, AnEchoOfReportsIsNoHost) {
  greet();
  ASSERT_EQ(ask(steady(200)), link::Result::ok);
  std::uint8_t body[link::kMaxBodyBytes];
  for (int i = 0; i < 60; ++i) {
    send_body(body, link::encode(link::Status{}, 0, body));
    run(100000);
  }
  EXPECT_TRUE(board.dark());
}

TEST_P(FirmwareLed, PatternThatBeganLongAgoIsJoinedAtItsPresentBit) {
  greet();
  // More than one repetition of 32767 bits.
  const std::uint32_t start_us = board.now_us - 100000000;
  ASSERT_EQ(ask(pattern(2000, 12345, start_us)), link::Result::ok);
  run_alive(300000);
  const std::uint32_t joined_us = board.now_us;
  run_alive(500000);
  expect_bits(2000, 12345, start_us, joined_us, board.now_us - 2000);
}

TEST_P(FirmwareLed, ALimitedPatternShowsItsBitsForAShorterTime) {
  greet();
  const std::uint32_t start_us = board.now_us;
  ASSERT_EQ(ask(pattern(4000, 5, start_us)), link::Result::ok);
  // Of 500 permille in the long run, 200 too much: about 35 s.
  int seconds = 0;
  for (; seconds < 60 && all<link::Fault>().empty(); ++seconds) run_alive(1000000);
  EXPECT_NEAR(seconds, 35, 12);
  EXPECT_EQ(last_fault().code, link::FaultCode::led_limited);
  board.light.clear();
  const std::uint32_t limited_us = board.now_us;
  run_alive(2000000);
  std::uint32_t on_us = 0;
  for (std::size_t i = 1; i < board.light.size(); ++i) {
    if (!board.light[i].on) on_us += board.light[i].at_us - board.light[i - 1].at_us;
  }
  EXPECT_NEAR(on_us, 0.3 * 2000000, 0.03 * 2000000);
  expect_bits(4000, 5, start_us, limited_us + 4000, board.now_us - 4000);
}

TEST_P(FirmwareLed, WhatTheLedOrTheBoardCannotDoIsRefusedAndChangesNothing) {
  greet();
  ASSERT_EQ(ask(steady(123)), link::Result::ok);
  for (const link::Led& wrong :
       {steady(1001), strobe(1999, 500, 0), strobe(1000001, 500, 0), strobe(10000, 99, 0),
        strobe(30000, 20001, 0), strobe(10000, 9901, 0), pattern(1999, 1, 0), pattern(4000, 0, 0),
        pattern(4000, 32768, 0)}) {
    EXPECT_EQ(ask(wrong), link::Result::out_of_range);
    EXPECT_EQ(board.steady_permille, 123);
    EXPECT_FALSE(board.pulses);
  }
  EXPECT_EQ(ask(strobe(10000, 9900, 0)), link::Result::ok);
}

TEST_P(FirmwareLed, GoesDarkAtOnceWhenToldTo) {
  greet();
  ASSERT_EQ(ask(strobe(10000, 5000, board.now_us)), link::Result::ok);
  run(53000);
  ASSERT_EQ(ask(link::Led{}), link::Result::ok);
  EXPECT_TRUE(board.dark());
  board.light.clear();
  run(1000000);
  EXPECT_TRUE(board.light.empty());
}

INSTANTIATE_TEST_SUITE_P(Clock, FirmwareLed, kClockStarts);

}  // namespace
}  // namespace tagwrench::firmware
