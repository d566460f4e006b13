#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/board/cell_calibration.h"

namespace tagwrench::link {
namespace {

TimePoint at(double t) {
  return TimePoint(Duration(static_cast<std::int64_t>(std::llround(t * 1e9))));
}

constexpr HistoryOptions kAt80{.period = 1.0 / 80, .delay = 0};

TEST(SampleHistoryTest, AStraightLineIsInterpolatedExactly) {
  SampleHistory history(kAt80);
  for (int i = 0; i < 100; ++i) history.add(at(i / 80.0), Duration(0), 3 + 2 * i / 80.0);
  for (double t = 0; t < 99 / 80.0; t += 0.0037) {
    const Aligned got = history.at(at(t));
    ASSERT_EQ(got.status, AlignStatus::ok) << t;
    ASSERT_NEAR(got.value, 3 + 2 * t, 1e-8);
    ASSERT_LT(got.sigma, 1e-7);
  }
}

TEST(SampleHistoryTest, BeforeAndAfterTheSamplesNothingIsGuessed) {
  SampleHistory history(kAt80);
  EXPECT_EQ(history.at(at(1)).status, AlignStatus::empty);
  history.add(at(1), Duration(0), 5);
  EXPECT_EQ(history.at(at(0.999)).status, AlignStatus::too_old);
  EXPECT_EQ(history.at(at(1.001)).status, AlignStatus::too_new);
  history.add(at(1 + 1 / 80.0), Duration(0), 6);
  EXPECT_EQ(history.at(at(1)).value, 5);
  EXPECT_NEAR(history.at(at(1 + 1 / 80.0)).value, 6, 1e-6) << "the last sample itself";
  EXPECT_EQ(history.at(at(1.02)).status, AlignStatus::too_new);
}

TEST(SampleHistoryTest, AGapIsAGap) {
  SampleHistory history(kAt80);
  for (int i = 0; i < 20; ++i) {
    if (i != 10) history.add(at(i / 80.0), Duration(0), i);
  }
  EXPECT_EQ(history.at(at(9.5 / 80)).status, AlignStatus::gap);
  EXPECT_EQ(history.at(at(10.5 / 80)).status, AlignStatus::gap);
  EXPECT_EQ(history.at(at(8.5 / 80)).status, AlignStatus::ok);
  EXPECT_EQ(history.at(at(11.5 / 80)).status, AlignStatus::ok);
}

TEST(SampleHistoryTest, ACountedLossIsAGapEvenIfTheTimesLieClose) {
  SampleHistory history({.period = 0, .delay = 0});
  history.add(at(1), Duration(0), 1);
  history.add(at(1.01), Duration(0), 2, 0, /*lost_before=*/true);
  history.add(at(1.02), Duration(0), 3);
  EXPECT_EQ(history.at(at(1.005)).status, AlignStatus::gap);
  EXPECT_EQ(history.at(at(1.015)).status, AlignStatus::ok);
}

TEST(SampleHistoryTest, NoiseIsFoundUnderASlowSignal) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.03);
  SampleHistory history(kAt80);
  for (int i = 0; i < 500; ++i)
    history.add(at(i / 80.0), Duration(0), 5 * std::sin(i / 80.0) + noise(random));
  EXPECT_NEAR(history.noise(), 0.03, 0.01);
}

TEST(SampleHistoryTest, StatedSigmaCoversTheErrorOfAMovingNoisySignalWithUncertainTimes) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 1);
  double squares = 0;
  int n = 0;
  for (int run = 0; run < 50; ++run) {
    SampleHistory history(kAt80);
    const auto truth = [&](double t) { return 2 * std::sin(2 * 3.14159 * 2 * t + run); };
    const double clock_error = 500e-6 * normal(random);  // one for all, as a clock's is
    for (int i = 0; i < 200; ++i) {
      history.add(at(i / 80.0 + clock_error), std::chrono::microseconds(500),
                  truth(i / 80.0) + 0.002 * normal(random));
    }
    for (double t = 1; t < 2.4; t += 0.0371) {
      const Aligned got = history.at(at(t));
      ASSERT_EQ(got.status, AlignStatus::ok);
      squares += std::pow((got.value - truth(t)) / got.sigma, 2);
      ++n;
    }
  }
  EXPECT_LT(std::sqrt(squares / n), 1.2);
  EXPECT_GT(std::sqrt(squares / n), 0.4);
}

TEST(SampleHistoryTest, AFiltersDelayIsTakenFromTheTimes) {
  SampleHistory history({.period = 1.0 / 80, .delay = 0.025});
  for (int i = 0; i < 20; ++i) history.add(at(1 + i / 80.0), Duration(0), i / 80.0);
  EXPECT_NEAR(history.at(at(1.1)).value, 0.125, 1e-6);
}

TEST(SampleHistoryTest, OldSamplesLeaveAndTimesThatGoBackAreIgnored) {
  SampleHistory history(kAt80);
  for (int i = 0; i < 600; ++i) history.add(at(i / 80.0), Duration(0), i);
  history.add(at(1), Duration(0), -1e9);
  EXPECT_EQ(history.at(at(1)).status, AlignStatus::too_old);
  EXPECT_NEAR(history.at(at(590.5 / 80)).value, 590.5, 1e-6);
}

}  // namespace
}  // namespace tagwrench::link
