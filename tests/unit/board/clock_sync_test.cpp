#include "host/board/clock_sync.h"

#include <gtest/gtest.h>

#include "synthetic_link.h"

namespace tagwrench::link {
namespace {

struct Errors {
  double rms_us = 0;
  double mean_us = 0;
  double worst_us = 0;
  double normalised = 0;         ///< rms of error over random_sigma
  double normalised_total = 0;   ///< rms of error over sigma
  double converged_after_s = 0;  ///< mean; a run that never converged counts as 1000 s
  std::uint32_t rejected = 0;
};

/// 20 boards, 45 s each, ten exchanges a second; times of the last 100 ms asked after 10 s.
Errors errors_of(const PathDelays& path, double wander = 2e-6) {
  Errors out;
  int n = 0;
  double squares = 0, sum = 0, normal = 0, total = 0;
  constexpr int kBoards = 20;
  for (unsigned seed = 0; seed < kBoards; ++seed) {
    SyntheticLink link(seed, path, seed % 2 == 0 ? -40e-6 : 3000e-6, wander);
    ClockSync clock;
    double converged_after = 1000;
    double end = 0;
    for (double t = SyntheticLink::kStart + 0.1; t < SyntheticLink::kStart + 45;
         t += 0.09 + 0.02 * link.draw()) {
      clock.add(link.exchange(t, end));
      if (converged_after > 100 && clock.report().converged)
        converged_after = t - SyntheticLink::kStart;
      if (t < SyntheticLink::kStart + 10) continue;
      const double asked = end - 0.1 * link.draw();
      const HostTime told = clock.to_host(link.board_us(asked));
      const double error = SyntheticLink::seconds(told.time - SyntheticLink::host(asked));
      ++n;
      sum += error;
      squares += error * error;
      out.worst_us = std::max(out.worst_us, std::abs(error) * 1e6);
      normal += std::pow(error / SyntheticLink::seconds(told.random_sigma), 2);
      total += std::pow(error / SyntheticLink::seconds(told.sigma), 2);
    }
    out.converged_after_s += converged_after / kBoards;
    out.rejected += clock.report().rejected;
  }
  out.rms_us = std::sqrt(squares / n) * 1e6;
  out.mean_us = sum / n * 1e6;
  out.normalised = std::sqrt(normal / n);
  out.normalised_total = std::sqrt(total / n);
  std::printf(
      "  rms %.1f us, mean %.1f us, worst %.0f us, error/random sigma %.2f, error/sigma "
      "%.2f, converged after %.2f s\n",
      out.rms_us, out.mean_us, out.worst_us, out.normalised, out.normalised_total,
      out.converged_after_s);
  return out;
}

TEST(ClockSyncTest, SymmetricPathWithLittleJitterGivesMicroseconds) {
  const Errors errors = errors_of({.jitter = 0.125e-3});
  EXPECT_LT(errors.rms_us, 12);
  EXPECT_LT(errors.normalised, 1.2);
  EXPECT_GT(errors.normalised, 0.6);
  EXPECT_LT(errors.converged_after_s, 2);
}

TEST(ClockSyncTest, SymmetricPathWithAMillisecondOfJitterIsWithin50MicrosecondsRms) {
  const Errors errors = errors_of({.jitter = 1e-3});
  EXPECT_LT(errors.rms_us, 50);
  EXPECT_LT(std::abs(errors.mean_us), 10);
  EXPECT_LT(errors.normalised, 1.2);
  EXPECT_GT(errors.normalised, 0.7);
  EXPECT_LT(errors.converged_after_s, 4);
}

TEST(ClockSyncTest, JitterOnTheWayBackAloneIsNoBias) {
  const Errors errors = errors_of({.jitter = 1e-3, .jitter_there = false});
  EXPECT_LT(errors.rms_us, 30) << "a mean jitter of 500 us would otherwise bias by 250 us";
  EXPECT_LT(errors.normalised, 1.2);
}

TEST(ClockSyncTest, AnAdapterThatCollectsBytesFor16MillisecondsIsCoveredByItsSigma) {
  const Errors errors = errors_of({.jitter = 16e-3, .tail_share = 0, .jitter_there = false});
  EXPECT_LT(errors.rms_us, 150);
  EXPECT_LT(errors.normalised, 0.8) << "what is not known of the least round trip is in it";
}

TEST(ClockSyncTest, AConstantAsymmetryIsWithinTheStatedSigma) {
  const Errors errors = errors_of({.there = 60e-6, .back = 1060e-6});
  EXPECT_NEAR(errors.mean_us, 500, 30) << "half of the difference, which nothing can remove";
  EXPECT_LT(errors.normalised_total, 1.75) << "half the round trip is sqrt(3) sigma";
}

TEST(ClockSyncTest, AToldAsymmetryIsRemoved) {
  const PathDelays path{.there = 60e-6, .back = 1060e-6, .jitter = 0.1e-3};
  SyntheticLink link(3, path, 500e-6);
  ClockSync clock;
  clock.set_asymmetry(std::chrono::microseconds(-1000), std::chrono::microseconds(20));
  double end = 0;
  for (double t = 100; t < 120; t += 0.1) clock.add(link.exchange(t, end));
  const HostTime told = clock.to_host(link.board_us(end));
  EXPECT_NEAR(SyntheticLink::seconds(told.time - SyntheticLink::host(end)) * 1e6, 0, 50);
  EXPECT_LT(told.sigma, std::chrono::microseconds(40));
}

TEST(ClockSyncTest, SkewOfAResonatorIsFound) {
  SyntheticLink link(1, {}, 4800e-6, 0);
  ClockSync clock;
  double end = 0;
  for (double t = 100; t < 130; t += 0.1) clock.add(link.exchange(t, end));
  const ClockReport report = clock.report();
  EXPECT_NEAR(report.skew_ppm, 4800, 5 * report.skew_sigma_ppm + 1);
  EXPECT_LT(report.skew_sigma_ppm, 10);
  EXPECT_EQ(report.rejected, 0u);
}

TEST(ClockSyncTest, TimeGoesOnOverTheWrapOf32Bits) {
  SyntheticLink link(5, {.jitter = 0.1e-3}, -40e-6);
  link.set_board_start(4294.967296 - 10);
  ClockSync clock;
  double end = 0;
  TimePoint last{};
  for (double t = 100; t < 125; t += 0.1) {
    ASSERT_TRUE(clock.add(link.exchange(t, end)));
    if (t < 105) continue;
    for (const double asked : {end - 0.2, end, end + 0.2}) {
      const HostTime told = clock.to_host(link.board_us(asked));
      ASSERT_NEAR(SyntheticLink::seconds(told.time - SyntheticLink::host(asked)), 0, 60e-6);
    }
    const TimePoint now = clock.to_host(link.board_us(end)).time;
    ASSERT_GT(now, last);
    last = now;
  }
  EXPECT_EQ(clock.report().jumps, 0u);
}

TEST(ClockSyncTest, ASilenceOfHoursIsBridgedByTheHostsClock) {
  SyntheticLink link(6, {.jitter = 0.1e-3}, -40e-6);
  ClockSync clock;
  double end = 0;
  for (double t = 100; t < 120; t += 0.1) clock.add(link.exchange(t, end));
  for (double t = 100 + 7200; t < 7320; t += 0.1) clock.add(link.exchange(t, end));
  const HostTime told = clock.to_host(link.board_us(end));
  EXPECT_NEAR(SyntheticLink::seconds(told.time - SyntheticLink::host(end)), 0, 100e-6);
}

TEST(ClockSyncTest, AHostTimeAsBoardTimeAndBackIsItself) {
  SyntheticLink link(7, {}, 2000e-6);
  ClockSync clock;
  double end = 0;
  for (double t = 100; t < 110; t += 0.1) clock.add(link.exchange(t, end));
  for (double ahead = -5; ahead < 60; ahead += 0.7) {
    const TimePoint host = clock.latest() + Duration(static_cast<std::int64_t>(ahead * 1e9));
    const HostTime back = clock.to_host(clock.to_board(host));
    ASSERT_NEAR(SyntheticLink::seconds(back.time - host) * 1e6, 0, 0.6) << ahead;
  }
}

TEST(ClockSyncTest, OutliersAreRejectedAndCounted) {
  SyntheticLink link(8, {.jitter = 0.2e-3}, -40e-6);
  ClockSync clock;
  double end = 0;
  unsigned spoilt = 0;
  for (int i = 0; i < 300; ++i) {
    TimeExchange exchange = link.exchange(100 + 0.1 * i, end);
    if (i % 17 == 9) {  // a stamp that does not belong to this exchange
      exchange.board_received_us += 70'000;
      exchange.board_sent_us += 70'000;
      ++spoilt;
    }
    EXPECT_EQ(clock.add(exchange), i % 17 != 9) << i;
  }
  EXPECT_EQ(clock.report().rejected, spoilt);
  const HostTime told = clock.to_host(link.board_us(end));
  EXPECT_NEAR(SyntheticLink::seconds(told.time - SyntheticLink::host(end)), 0, 50e-6);
}

TEST(ClockSyncTest, WhatCannotBeIsRejected) {
  SyntheticLink link(9, {}, 0);
  ClockSync clock;
  double end = 0;
  TimeExchange late = link.exchange(100, end);
  late.host_received += std::chrono::seconds(2);
  EXPECT_FALSE(clock.add(late));
  TimeExchange before = link.exchange(101, end);
  before.host_received = before.host_sent - std::chrono::milliseconds(50);
  EXPECT_FALSE(clock.add(before));
  TimeExchange reversed = link.exchange(102, end);
  std::swap(reversed.board_received_us, reversed.board_sent_us);
  EXPECT_FALSE(clock.add(reversed));
  EXPECT_FALSE(clock.known());
}

TEST(ClockSyncTest, AClockThatJumpsIsFollowedWithinASecond) {
  SyntheticLink link(10, {.jitter = 0.2e-3}, -40e-6);
  ClockSync clock;
  double end = 0;
  for (double t = 100; t < 120; t += 0.1) clock.add(link.exchange(t, end));
  link.set_board_start(3000.5);
  for (double t = 120; t < 121; t += 0.1) clock.add(link.exchange(t, end));
  EXPECT_EQ(clock.report().jumps, 1u);
  const HostTime told = clock.to_host(link.board_us(end));
  EXPECT_NEAR(SyntheticLink::seconds(told.time - SyntheticLink::host(end)), 0, 1e-3);
}

TEST(ClockSyncTest, RestartForgetsEverythingButTheAsymmetry) {
  SyntheticLink link(11, {}, -40e-6);
  ClockSync clock;
  clock.set_asymmetry(Duration(0), std::chrono::microseconds(7));
  double end = 0;
  for (double t = 100; t < 105; t += 0.1) clock.add(link.exchange(t, end));
  clock.restart();
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.report().exchanges, 0u);
  link.set_board_start(0);
  for (double t = 105; t < 110; t += 0.1) EXPECT_TRUE(clock.add(link.exchange(t, end)));
  EXPECT_NEAR(clock.report().asymmetry_sigma.count(), 3500, 1);
}

/// Error over sigma of a time 50 ms after the exchange.
double error_over_sigma(const SyntheticLink& link, const ClockSync& clock, double end) {
  const HostTime told = clock.to_host(link.board_us(end + 0.05));
  return std::abs(SyntheticLink::seconds(told.time - SyntheticLink::host(end + 0.05))) /
         SyntheticLink::seconds(told.sigma);
}

TEST(ClockSyncTest, AClockTenPercentOffIsNotFollowedButItsSigmaSaysSo) {
  SyntheticLink link(12, {.jitter = 0.2e-3}, 0.1);
  ClockSync clock;
  double end = 0;
  for (int i = 0; i < 600; ++i) {
    clock.add(link.exchange(100 + 0.1 * i, end));
    if (i > 0) {
      ASSERT_LT(error_over_sigma(link, clock, end), 2) << i;
      ASSERT_FALSE(clock.report().converged);
    }
  }
}

TEST(ClockSyncTest, WhileExchangesContradictTheSigmaCoversByHowMuch) {
  for (const double jump : {0.05, -0.05, 3.0, -3.0}) {
    SyntheticLink link(13, {.jitter = 0.2e-3}, 200e-6);
    ClockSync clock;
    double end = 0;
    for (double t = 100; t < 120; t += 0.1) clock.add(link.exchange(t, end));
    link.set_board_start(3000 + jump);
    for (int i = 0; i < 50; ++i) {
      clock.add(link.exchange(120 + 0.1 * i, end));
      ASSERT_LT(error_over_sigma(link, clock, end), 2) << jump << " s, " << i;
    }
    EXPECT_EQ(clock.report().jumps, 1u) << jump;
    EXPECT_TRUE(clock.report().converged) << "a single jump is over";
  }
}

TEST(ClockSyncTest, AClockThatStandsStillHasNoSmallSigma) {
  SyntheticLink link(14, {}, 0);
  ClockSync clock;
  double end = 0;
  TimeExchange exchange = link.exchange(100, end);
  for (int i = 0; i < 100; ++i) {
    clock.add(exchange);
    exchange.host_sent += std::chrono::milliseconds(100);
    exchange.host_received += std::chrono::milliseconds(100);
    if (i <= 8) continue;  // one jump is believed
    ASSERT_GT(clock.to_host(exchange.board_received_us).sigma, std::chrono::milliseconds(90)) << i;
  }
}

TEST(ClockSyncTest, RoundTripsBelowZeroWidenTheSigmaFromTheFirstOn) {
  for (const PathDelays path : {PathDelays{.there = -400e-6, .back = -400e-6, .jitter = 0.1e-3},
                                PathDelays{.there = 100e-6, .back = -450e-6, .jitter = 50e-6}}) {
    SyntheticLink link(15, {path.there, path.back, path.jitter, 0}, 0);
    ClockSync clock;
    double end = 0;
    for (int i = 0; i < 100; ++i) {
      EXPECT_TRUE(clock.add(link.exchange(100 + 0.1 * i, end))) << i;
      ASSERT_LT(error_over_sigma(link, clock, end), 2) << i;
    }
  }
}

TEST(ClockSyncTest, ARequestBeforeTheLastOneIsRejected) {
  SyntheticLink link(16, {}, 0);
  ClockSync clock;
  double end = 0;
  for (double t = 100; t < 105; t += 0.1) clock.add(link.exchange(t, end));
  TimeExchange early = link.exchange(105, end);
  early.host_sent -= std::chrono::seconds(1);
  early.host_received -= std::chrono::seconds(1);
  EXPECT_FALSE(clock.add(early));
  EXPECT_TRUE(clock.add(link.exchange(105.1, end)));
}

TEST(ClockSyncTest, WhateverTheStampsTheSigmaIsAPositiveNumber) {
  std::mt19937_64 random(3);
  for (int run = 0; run < 50; ++run) {
    ClockSync clock;
    double host = 1000;
    for (int i = 0; i < 300; ++i) {
      constexpr double kSteps[] = {1e-9, 0.1, 30, -0.05};
      host += kSteps[random() % 4];
      TimeExchange exchange{};
      exchange.host_sent = SyntheticLink::host(host);
      exchange.host_received = SyntheticLink::host(host + 1e-6 * double(random() % 1000));
      exchange.board_received_us = static_cast<std::uint32_t>(
          random() % 3 ? static_cast<std::uint64_t>(host * 1e6) + random() % 2000 : random());
      exchange.board_sent_us =
          exchange.board_received_us + static_cast<std::uint32_t>(random() % 100);
      exchange.request_bytes = 9;
      exchange.reply_bytes = 25;
      clock.add(exchange);
      if (!clock.known()) continue;
      const HostTime told = clock.to_host(static_cast<std::uint32_t>(random()));
      ASSERT_GT(told.random_sigma.count(), 0);
      ASSERT_GE(told.sigma, told.random_sigma);
      ASSERT_TRUE(std::isfinite(clock.report().skew_ppm));
      ASSERT_GE(clock.report().skew_sigma_ppm, 0);
    }
  }
}

TEST(ClockSyncTest, TheFirstExchangeAlreadyGivesATimeWithAnHonestSigma) {
  double normal = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    SyntheticLink link(seed, {}, 0);
    ClockSync clock;
    double end = 0;
    clock.add(link.exchange(100, end));
    const HostTime told = clock.to_host(link.board_us(end));
    normal += std::pow(SyntheticLink::seconds(told.time - SyntheticLink::host(end)) /
                           SyntheticLink::seconds(told.sigma),
                       2);
  }
  EXPECT_LT(std::sqrt(normal / 200), 1.2);
}

}  // namespace
}  // namespace tagwrench::link
