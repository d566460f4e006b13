// Restarts, other hosts, and light that outlives both.
#include <gtest/gtest.h>

#include <algorithm>

#include "board_session_fixture.h"
#include "protocol/pattern.h"

namespace tagwrench::link {
namespace {

TEST_F(BoardSessionTest, ARestartedBoardIsConfiguredAndLitAgainAndSaid) {
  session.set_led(steady(200));
  run(3);
  ASSERT_FALSE(board.leds.empty());
  board.restart(78, now);
  board.leds.clear();
  news.clear();
  run(3);
  EXPECT_TRUE(told(BoardEvent::Kind::restarted));
  EXPECT_EQ(session.counters().restarts, 1u);
  EXPECT_TRUE(board.configured);
  ASSERT_FALSE(board.leds.empty());
  EXPECT_EQ(board.leds.back().level_permille, 200);
  const auto restarted = std::find_if(news.begin(), news.end(), [](const BoardEvent& n) {
    return n.kind == BoardEvent::Kind::restarted;
  });
  EXPECT_NE(text(*restarted).find("watchdog"), std::string::npos);
  const double error = SyntheticLink::seconds(session.clock().to_host(clock.board_us(now)).time -
                                              SyntheticLink::host(now));
  EXPECT_NEAR(error, 0, 1e-3) << "the clock started anew";
  EXPECT_EQ(session.clock().report().jumps, 0u) << "because it was told so";
}

TEST_F(BoardSessionTest, ASilentBoardIsGreetedAgain) {
  run(2);
  ASSERT_EQ(session.state(), BoardState::ready);
  connected = false;
  run(2);
  EXPECT_EQ(session.state(), BoardState::waiting);
  connected = true;
  run(1);
  EXPECT_EQ(session.state(), BoardState::ready);
  EXPECT_EQ(session.counters().restarts, 0u);
}

TEST_F(BoardSessionTest, AnotherHostOnTheSameBoardIsSaidOnce) {
  run(2);
  for (int i = 0; i < 5; ++i) {
    board.hello.session = 0xBAD;
    run(1.2);
  }
  EXPECT_EQ(
      std::count_if(news.begin(), news.end(),
                    [](const BoardEvent& n) { return n.kind == BoardEvent::Kind::other_host; }),
      1);
}

TEST_F(BoardSessionTest, LightIsRepeatedEverySecondAndOnceAtOnce) {
  run(1);
  session.set_led(steady(300));
  run(0.005);
  EXPECT_EQ(board.leds.size(), 1u);
  session.set_led(steady(310));
  run(0.005);
  EXPECT_EQ(board.leds.size(), 2u);
  run(10);
  EXPECT_NEAR(static_cast<double>(board.leds.size()), 12, 1);
}

TEST_F(BoardSessionTest, ARefusedLightIsSaidOnce) {
  board.led_result = Result::out_of_range;
  run(1);
  session.set_led(steady(2000));
  run(4);
  EXPECT_EQ(
      std::count_if(news.begin(), news.end(),
                    [](const BoardEvent& n) { return n.kind == BoardEvent::Kind::led_refused; }),
      1);
}

TEST_F(BoardSessionTest, AnOldStartOfAPatternIsMovedOnWithoutMovingItsBits) {
  status_period = 0.5;
  run(2);
  Led pattern{};
  pattern.mode = LedMode::pattern;
  pattern.period_us = 7000;
  pattern.pattern_seed = 21;
  pattern.start_us = session.clock().to_board(SyntheticLink::host(now)) - (1u << 30);
  session.set_led(pattern);
  run(0.1);
  ASSERT_FALSE(board.leds.empty());
  const Led& sent_led = board.leds.back();
  const std::uint32_t moved = sent_led.start_us - pattern.start_us;
  EXPECT_GT(moved, 1u << 29);
  ASSERT_EQ(moved % pattern.period_us, 0u);
  std::uint16_t state = pattern.pattern_seed;
  for (std::uint32_t k = moved / pattern.period_us; k > 0; --k) state = next_pattern_state(state);
  EXPECT_EQ(sent_led.pattern_seed, state);
}

/// A restarted board's clock begins at zero; the light goes on as if it had not.
TEST_F(BoardSessionTest, AfterARestartALightKeepsItsPhaseInHostTime) {
  for (const LedMode mode : {LedMode::strobe, LedMode::pattern}) {
    run(40);
    Led led{};
    led.mode = mode;
    led.period_us = 7000;
    led.width_us = 500;
    led.pattern_seed = 21;
    led.start_us = clock.board_us(now) - 300'000;
    const double start = now - 0.3 / (1 + 1500e-6);
    session.set_led(led);
    run(5.5);
    for (const std::uint32_t boot_id : {board.hello.boot_id + 1, board.hello.boot_id + 2}) {
      board.leds.clear();
      board.led_times.clear();
      board.restart(boot_id, now);
      const double restarted = now;
      run(6);
      ASSERT_FALSE(board.leds.empty());
      EXPECT_LT(board.led_times.front() - restarted, 3) << "s that it is dark";
      const Led& again = board.leds.front();
      const double ago = static_cast<std::int32_t>(clock.board_us(now) - again.start_us) * 1e-6;
      ASSERT_GT(ago, 0) << "not dark until the new clock comes to the old start";
      // Periods are those of the board's clock, which is 1500 ppm faster.
      const double periods = (now - ago / (1 + 1500e-6) - start) * (1 + 1500e-6) / 7e-3;
      EXPECT_NEAR((periods - std::round(periods)) * 7000, 0, 100) << "us of phase";
      if (mode == LedMode::pattern) {
        std::uint16_t state = led.pattern_seed;
        for (long k = std::lround(periods); k > 0; --k) state = next_pattern_state(state);
        EXPECT_EQ(again.pattern_seed, state);
      }
      for (const Led& repeated : board.leds) EXPECT_EQ(repeated.start_us, again.start_us);
    }
  }
}

TEST_F(BoardSessionTest, AfterAnOutageLongerThanHalfAWrapALightGoesOnAtOnce) {
  run(5);
  Led led{};
  led.mode = LedMode::strobe;
  led.period_us = 7000;
  led.width_us = 500;
  led.start_us = clock.board_us(now);
  session.set_led(led);
  run(2);
  session.reconnect();
  now += 2400;
  board.leds.clear();
  board.restart(78, now);
  run(6);
  ASSERT_FALSE(board.leds.empty());
  const auto ago = static_cast<std::int32_t>(clock.board_us(now) - board.leds.front().start_us);
  EXPECT_GT(ago, 0);
  EXPECT_LT(ago, 6'000'000);
}

TEST_F(BoardSessionTest, AClockThatJumpsDoesNotRestartTheCells) {
  run(10);
  const unsigned greeted = board.hello_requests;
  board.configured = false;
  clock.set_board_start(4000);
  for (int i = 0; i < 2000; ++i) {
    run(0.001);
    ASSERT_EQ(session.state(), BoardState::ready);
  }
  EXPECT_GT(board.hello_requests, greeted) << "it might have started anew";
  EXPECT_FALSE(board.configured) << "it is still as it was";
  EXPECT_EQ(session.counters().restarts, 0u);
  connected = false;
  run(2);
  connected = true;
  run(1);
  EXPECT_EQ(session.state(), BoardState::ready);
  EXPECT_FALSE(board.configured);
}

TEST_F(BoardSessionTest, ABoardThatAnotherHostHadIsConfiguredAgain) {
  run(3);
  board.configured = false;
  board.hello.session = 0xBAD;
  run(2);
  EXPECT_TRUE(board.configured);
}

TEST_F(BoardSessionTest, ABoardBehindANewLineIsConfiguredAgain) {
  run(3);
  board.configured = false;
  session.reconnect();
  run(1);
  EXPECT_TRUE(board.configured);
}

}  // namespace
}  // namespace tagwrench::link
