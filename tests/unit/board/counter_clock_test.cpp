#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/board/clock_sync.h"

namespace tagwrench::link {
namespace {

TimePoint moment(double t) { return TimePoint(Duration(static_cast<std::int64_t>(t * 1e9))); }
double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

TEST(CounterClockTest, TimesAreSmootherThanArrivals) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late(0, 4e-3);
  CounterClock clock(0.01);
  double squares = 0;
  double normal = 0;
  int n = 0;
  for (int i = 0; i < 6000; ++i) {
    const double truth = 50 + 0.01003 * i;  // 0.3 % off nominal
    const HostTime told =
        clock.take(static_cast<std::uint16_t>(65000 + i), moment(truth + late(random)));
    if (i < 500) continue;
    const double error = seconds(told.time - moment(truth + 2e-3));
    squares += error * error;
    normal += std::pow(error / seconds(told.sigma), 2);
    ++n;
  }
  EXPECT_LT(std::sqrt(squares / n), 150e-6) << "arrivals scatter by 1150 us";
  EXPECT_LT(std::sqrt(normal / n), 2);
  EXPECT_NEAR(clock.period(), 0.01003, 2e-6);
  EXPECT_EQ(clock.restarts(), 0u);
}

TEST(CounterClockTest, LostSamplesLeaveTheTimesWhereTheyAre) {
  CounterClock clock(0.01);
  for (int i = 0; i < 400; ++i) clock.take(static_cast<std::uint16_t>(i), moment(10 + 0.01 * i));
  const HostTime told = clock.take(450, moment(10 + 4.5));
  EXPECT_NEAR(seconds(told.time - moment(14.5)), 0, 1e-3);
}

TEST(CounterClockTest, ABatchThatArrivesLateIsDatedByItsCounter) {
  CounterClock clock(0.01);
  for (int i = 0; i < 400; ++i) clock.take(static_cast<std::uint16_t>(i), moment(10 + 0.01 * i));
  for (int i = 400; i < 420; ++i) {  // 20 samples at once, after the last of them
    const HostTime told = clock.take(static_cast<std::uint16_t>(i), moment(10 + 4.2));
    EXPECT_NEAR(seconds(told.time - moment(10 + 0.01 * i)), 0, 2e-3);
  }
}

TEST(CounterClockTest, StragglersNowAndThenAreLeftOut) {
  CounterClock clock(0.01);
  for (int i = 0; i < 6000; ++i) {
    const double truth = 10 + 0.01 * i;
    const HostTime told =
        clock.take(static_cast<std::uint16_t>(i), moment(truth + (i % 40 == 39 ? 0.2 : 0)));
    if (i > 200) {
      ASSERT_NEAR(seconds(told.time - moment(truth)), 0, 1e-3) << i;
    }
  }
  EXPECT_EQ(clock.restarts(), 0u);
}

TEST(CounterClockTest, ASensorThatStartsAnewIsFollowed) {
  CounterClock clock(0.01);
  for (int i = 0; i < 400; ++i) clock.take(static_cast<std::uint16_t>(i), moment(10 + 0.01 * i));
  HostTime told;
  for (int i = 0; i < 200; ++i)
    told = clock.take(static_cast<std::uint16_t>(i), moment(100 + 0.01 * i));
  EXPECT_NEAR(seconds(told.time - moment(101.99)), 0, 5e-3);
  EXPECT_GE(clock.restarts(), 1u);
}

}  // namespace
}  // namespace tagwrench::link
