// The LED against a host that goes astray or means harm: whatever it orders, and however often,
// the light that really shone stays within what a bare LED bears.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "protocol/pattern.h"
#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// 15 bits of light in a row, the most that the pattern has.
constexpr std::uint16_t kMaxLight = 21845;

struct LedAbuseTest : testing::Test {
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF};
  BoardClient client{board};
  VirtualTime begin{};

  void SetUp() override {
    ASSERT_TRUE(client.greet());
    begin = board.now();
  }
  void TearDown() override {
    EXPECT_EQ(board.gate_conflicts(), 0U) << "both pins drove the gate against each other";
  }

  std::uint32_t soon_us(microseconds from_now) {
    return static_cast<std::uint32_t>(board.board_us()) +
           static_cast<std::uint32_t>(from_now.count());
  }
  static link::Led steady(std::uint16_t permille) {
    link::Led led{};
    led.mode = link::LedMode::steady;
    led.level_permille = permille;
    return led;
  }
  link::Led strobe(std::uint32_t period_us, std::uint16_t width_us, microseconds from_now) {
    link::Led led{};
    led.mode = link::LedMode::strobe;
    led.period_us = period_us;
    led.width_us = width_us;
    led.start_us = soon_us(from_now);
    return led;
  }
  link::Led pattern(std::uint32_t period_us, std::uint16_t seed, microseconds from_now) {
    link::Led led{};
    led.mode = link::LedMode::pattern;
    led.period_us = period_us;
    led.pattern_seed = seed;
    led.start_us = soon_us(from_now);
    return led;
  }

  /// Calls `order` every `step` for 72 s, and holds the light that shone against the limit: 10 s of
  /// 1000 permille from cold, 300 for ever.
  template <typename Order>
  void abuse(VirtualTime step, const Order& order) {
    const VirtualTime end = begin + seconds(72);
    for (int i = 0; board.now() < end; ++i) {
      order(i);
      client.run(step);
    }
    expect_within_limit();
  }
  void expect_within_limit() {
    const double first = board.led().mean(begin, begin + seconds(60));
    const double later = board.led().mean(begin + seconds(12), begin + seconds(72));
    fmt::print("  mean {:.3f} over the first 60 s, {:.3f} from 12 s to 72 s\n", first, later);
    EXPECT_LE(first, 0.45);
    EXPECT_LE(later, 0.32);
  }
};

TEST_F(LedAbuseTest, AStrobeOrderedAnewAtEachPulseIsLimitedByItsTrueLight) {
  abuse(milliseconds(22), [&](int) { client.send(strobe(1000000, 20000, microseconds(2500))); });
}

TEST_F(LedAbuseTest, APatternOrderedAnewWithinItsFirstBitIsLimitedByItsTrueLight) {
  abuse(milliseconds(100),
        [&](int) { client.send(pattern(1000000, kMaxLight, microseconds(2500))); });
}

TEST_F(LedAbuseTest, ALongRunOfLightOrderedAgainAndAgainIsLimitedByItsTrueLight) {
  abuse(milliseconds(100), [&](int i) {
    if (i % 140 == 0) {
      client.send(pattern(1000000, kMaxLight, microseconds(2500)));
    } else {
      client.send(link::TimeRequest{});
    }
  });
}

TEST_F(LedAbuseTest, ModesInQuickTurnAreLimitedByTheirTrueLight) {
  abuse(milliseconds(10), [&](int i) {
    switch (i % 4) {
      case 0: client.send(steady(1000)); break;
      case 1: client.send(strobe(22000, 19000, microseconds(1500))); break;
      case 2: client.send(pattern(20000, kMaxLight, microseconds(1500))); break;
      default: client.send(strobe(1000000, 20000, microseconds(1500)));
    }
  });
}

TEST_F(LedAbuseTest, AResetDoesNotForgetTheHeat) {
  while (board.now() < begin + seconds(72)) {
    board.press_reset();
    client.run(milliseconds(50));
    ASSERT_TRUE(client.greet());
    ASSERT_EQ(client.ask(steady(1000)), link::Result::ok);
    for (int i = 0; i < 99; ++i) {
      client.send(link::TimeRequest{});
      client.run(milliseconds(100));
    }
  }
  expect_within_limit();
}

TEST_F(LedAbuseTest, TheBoardsOwnReportsComingBackAreNoSignOfLife) {
  link::Configure configuration = full_configuration();
  configuration.host_timeout_ms = 1000;
  ASSERT_EQ(client.ask(configuration), link::Result::ok);
  ASSERT_EQ(client.ask(steady(300)), link::Result::ok);
  const VirtualTime silent_from = board.now();
  std::size_t echoed = 0;
  while (board.now() < silent_from + seconds(3)) {
    std::vector<std::uint8_t> bytes;
    for (const SentByte& byte : board.read()) bytes.push_back(byte.value);
    if (!bytes.empty()) board.write(bytes);
    echoed += bytes.size();
    board.advance_by(milliseconds(1));
  }
  EXPECT_GT(echoed, 1000U);
  EXPECT_GT(board.led().level_at(silent_from + milliseconds(900)), 0.2);
  EXPECT_EQ(board.led().mean(silent_from + milliseconds(1100), board.now()), 0);
}

/// Starts in the past, each 2 us later with regard to the order, so that the first edge after the
/// order falls at every moment of the board's making it.
TEST_F(LedAbuseTest, NoLightOfAPatternBegunInThePastLastsBeyondItsBit) {
  constexpr microseconds kBit(2000);
  constexpr int kBitsSeen = 18;
  client.run(seconds(2));  // board time past all of the starts
  int wrong = 0;
  int bright_bits = 0;
  int lit = 0;
  double worst_us = 0;
  for (int offset_us = 0; offset_us < 2000; offset_us += 2) {
    for (const int bits_past : {50, 399, 400}) {
      const link::Led order = pattern(2000, 1, microseconds(offset_us) - bits_past * kBit);
      const VirtualTime start = board.true_time(order.start_us);
      client.send(order);
      client.run(kBitsSeen * kBit + milliseconds(4), milliseconds(4));
      std::uint16_t state = order.pattern_seed;
      for (int bit = 0; bit < bits_past + kBitsSeen; ++bit) {
        const VirtualTime from = start + bit * kBit;
        const double light_us = 2000 * board.led().mean(from, from + kBit);
        // The pattern before shines until the board has read the order.
        if (bit >= bits_past + 2 && link::pattern_light(state)) {
          ++bright_bits;
          lit += light_us > 500 ? 1 : 0;
        } else if (bit >= bits_past + 2) {
          worst_us = std::max(worst_us, light_us);
          wrong += light_us > 1000 ? 1 : 0;
        }
        state = link::next_pattern_state(state);
      }
      board.led().forget();
      client.forget();
    }
  }
  fmt::print("  {} of {} bright bits lit, {:.0f} us of light in a dark bit at most\n", lit,
             bright_bits, worst_us);
  EXPECT_GT(lit, bright_bits / 2) << "the limit may darken some";
  EXPECT_EQ(wrong, 0) << "dark bits that shone for more than 1 ms";
}

}  // namespace
}  // namespace tagwrench::emulator
