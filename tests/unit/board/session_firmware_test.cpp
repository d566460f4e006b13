// The host's session and the board's application, each the real one, on a virtual line with delays.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

#include "firmware/app/app.h"
#include "host/board/board_session.h"
#include "synthetic_link.h"
#include "tests/unit/firmware/fake_board.h"

namespace tagwrench::link {
namespace {

constexpr double kByte = 20e-6;  ///< s, on the wire

class SessionFirmwareTest : public ::testing::Test {
 protected:
  SessionFirmwareTest() : session(options()) { start(7, ResetCause::power_on); }

  static BoardSessionOptions options() {
    BoardSessionOptions out;
    out.session = 0xCAFE0001;
    out.new_id = {{1, 2, 3, 4, 5, 6, 7, 8}, 8};
    return out;
  }

  void start(std::uint32_t boot_id, ResetCause cause) {
    const UniqueId kept = board::fake_board().id;
    board::fake_board() = board::FakeBoard{};
    board::fake_board().id = boot_id == 7 ? UniqueId{} : kept;
    board::fake_board().boot_id = boot_id;
    board::fake_board().reset_cause = cause;
    board_start = now;
    app = firmware::App(board::fake_board().now_us);
  }

  /// Host time is `now`; the board's runs 900 ppm faster, from its start on.
  std::uint32_t board_us(double t) const {
    return static_cast<std::uint32_t>(1000 + (t - board_start) * 1e6 * (1 + 900e-6));
  }

  void run(double seconds) {
    for (const double until = now + seconds; now < until; now += 250e-6) {
      board::FakeBoard& hardware = board::fake_board();
      hardware.advance(board_us(now) - hardware.now_us);
      convert();
      app.poll(hardware.now_us);
      if (!hardware.sent.empty()) {
        to_host.push_back({now + kDelay + kByte * static_cast<double>(hardware.sent.size()),
                           std::exchange(hardware.sent, {})});
      }
      while (!to_host.empty() && to_host.front().arrival <= now) {
        if (plugged)
          session.take(to_host.front().bytes, SyntheticLink::host(to_host.front().arrival));
        to_host.pop_front();
      }
      std::uint8_t out[BoardSession::kMaxBytesOut];
      const std::size_t count = session.poll(SyntheticLink::host(now), out);
      for (std::size_t i = 0; i < count && plugged; ++i) {
        const double complete = now + kDelay + kByte * static_cast<double>(i + 1);
        hardware.incoming.push_back({out[i], board_us(complete)});
      }
      for (BoardEvent item; session.next(item);) news.push_back(item);
    }
  }

  /// 80 conversions a second of each cell that is on; their counts are the time in ms.
  void convert() {
    board::FakeBoard& hardware = board::fake_board();
    if (now < next_conversion) return;
    next_conversion = std::max(next_conversion + 1 / 80.0, now);
    for (std::uint8_t i = 0; i < kMaxCells; ++i) {
      if (hardware.inputs[i] == CellInput::off || i == unwired) continue;
      hardware.conversions.push_back(
          {i, static_cast<std::int32_t>((now - kStart) * 1000), hardware.now_us, 0, false});
    }
  }
  bool told(BoardEvent::Kind kind) const {
    return std::any_of(news.begin(), news.end(),
                       [&](const BoardEvent& n) { return n.kind == kind; });
  }

  struct Batch {
    double arrival;
    std::vector<std::uint8_t> bytes;
  };
  static constexpr double kStart = 50;
  static constexpr double kDelay = 100e-6;

  double now = kStart;
  double board_start = kStart;
  double next_conversion = kStart;
  int unwired = -1;
  bool plugged = true;
  firmware::App app{0};
  BoardSession session;
  std::deque<Batch> to_host;
  std::vector<BoardEvent> news;
};

TEST_F(SessionFirmwareTest, TheyUnderstandEachOther) {
  run(3);
  EXPECT_EQ(session.state(), BoardState::ready);
  EXPECT_STREQ(session.hello().board, "fake");
  EXPECT_EQ(session.capabilities().cells, 4);
  EXPECT_TRUE(session.has_status());
  EXPECT_EQ(session.status().session, options().session);
  EXPECT_EQ(board::fake_board().id.count, 8) << "it had none and was given one";
  EXPECT_TRUE(told(BoardEvent::Kind::id_given));
  const SessionCounters counters = session.counters();
  EXPECT_EQ(counters.damaged_frames + counters.unknown_frames + counters.lost_frames, 0u);
}

TEST_F(SessionFirmwareTest, SamplesHaveTheHostTimeOfTheirConversion) {
  run(6);
  for (CellReading old; session.next(old);) {
  }
  run(2);
  int seen = 0;
  for (CellReading reading; session.next(reading); ++seen) {
    // The board's times are of its polls, 0.25 ms apart; counts tell the time to 1 ms.
    const double truth = kStart + reading.counts * 1e-3;
    const double told = SyntheticLink::seconds(reading.time.time.time_since_epoch());
    ASSERT_NEAR(told - truth, 0.5e-3, 1e-3);
    ASSERT_EQ(reading.lost_before, 0);
  }
  EXPECT_NEAR(seen, 4 * 160, 8);
  EXPECT_NEAR(session.clock().report().skew_ppm, 900, 30);
}

TEST_F(SessionFirmwareTest, ACellThatIsNotWiredIsAFaultAndNoSamples) {
  unwired = 2;
  run(4);
  EXPECT_TRUE(std::any_of(news.begin(), news.end(), [](const BoardEvent& n) {
    return n.kind == BoardEvent::Kind::fault &&
           n.value == static_cast<std::uint32_t>(FaultCode::cell_silent) && n.other == 2;
  }));
  for (CellReading reading; session.next(reading);) EXPECT_NE(reading.channel, 2);
}

TEST_F(SessionFirmwareTest, TheLedStaysLitWhileTheHostLivesAndGoesOutWithIt) {
  Led led{};
  led.mode = LedMode::steady;
  led.level_permille = 250;
  session.set_led(led);
  run(12);
  EXPECT_EQ(board::fake_board().steady_permille, 250) << "longer than the host timeout";
  plugged = false;
  run(4.5);
  EXPECT_FALSE(board::fake_board().dark());
  run(1);
  EXPECT_TRUE(board::fake_board().dark()) << "5 s after the last word of the host";
  plugged = true;
  run(3);
  EXPECT_EQ(session.state(), BoardState::ready);
  EXPECT_EQ(board::fake_board().steady_permille, 250) << "lit again by itself";
}

TEST_F(SessionFirmwareTest, ABoardThatWasResetIsSetUpAgain) {
  Led led{};
  led.mode = LedMode::steady;
  led.level_permille = 100;
  session.set_led(led);
  run(3);
  start(8, ResetCause::watchdog);
  EXPECT_TRUE(board::fake_board().dark());
  run(4);
  EXPECT_TRUE(told(BoardEvent::Kind::restarted));
  EXPECT_EQ(board::fake_board().steady_permille, 100);
  EXPECT_EQ(session.counters().restarts, 1u);
  const double error = SyntheticLink::seconds(session.clock().to_host(board_us(now)).time -
                                              SyntheticLink::host(now));
  EXPECT_NEAR(error, 0, 0.5e-3);
}

TEST_F(SessionFirmwareTest, PulsesBeginAtTheHostTimeAskedFor) {
  run(4);
  Led led{};
  led.mode = LedMode::strobe;
  led.period_us = 40'000;
  led.width_us = 500;
  const double when = now + 0.2;
  led.start_us = session.clock().to_board(SyntheticLink::host(when));
  session.set_led(led);
  run(2.5);  // repeated twice meanwhile
  const auto& light = board::fake_board().light;
  ASSERT_GT(light.size(), 20u);
  EXPECT_NEAR(static_cast<double>(light[0].at_us), board_us(when), 300);
  for (std::size_t i = 2; i < light.size(); i += 2) {
    EXPECT_EQ(light[i].at_us - light[i - 2].at_us, 40'000u) << i;
    EXPECT_EQ(light[i - 1].at_us - light[i - 2].at_us, 500u);
  }
}

TEST_F(SessionFirmwareTest, TareGivesTheMeanOfTheNextConversions) {
  run(3);
  session.tare(0b0011, 40);
  run(2);
  TareResult result{};
  unsigned cells = 0;
  while (session.next(result)) {
    cells |= 1u << result.channel;
    EXPECT_EQ(result.conversions, 40);
    EXPECT_NEAR(result.mean_counts, 3250, 150);
  }
  EXPECT_EQ(cells, 0b0011u);
}

TEST_F(SessionFirmwareTest, ALightBeyondTheLimitsIsRefusedByTheBoard) {
  run(2);
  Led led{};
  led.mode = LedMode::strobe;
  led.period_us = 10;
  led.width_us = 5;
  session.set_led(led);
  run(1);
  EXPECT_TRUE(told(BoardEvent::Kind::led_refused));
  EXPECT_TRUE(board::fake_board().dark());
}

}  // namespace
}  // namespace tagwrench::link
