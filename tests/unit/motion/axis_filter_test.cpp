#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "host/motion/shaping.h"
#include "tests/unit/motion/pushed.h"

namespace tagwrench {
namespace {

constexpr double kFrame = 1.0 / 60;  // s

FilterOptions filter_of(FilterKind kind) {
  FilterOptions o;
  o.kind = kind;
  return o;
}

AxisFilter started_filter(const FilterOptions& options) {
  AxisFilter filter(options, Vector6::Ones());
  filter.start(Vector6::Zero());
  return filter;
}

Vector6 on_x(double value) { return value * Vector6::Unit(0); }

TEST(AxisFilter, ExponentialIsThePapersAtItsFrameRate) {
  AxisFilter filter = started_filter(filter_of(FilterKind::exponential));
  double paper = 0;
  for (int i = 0; i < 50; ++i) {
    const double value = std::sin(0.4 * i);
    paper = 0.2 * value + 0.8 * paper;
    EXPECT_NEAR(filter.step(0.04, on_x(value))[0], paper, 1e-12);
  }
}

TEST(AxisFilter, ExponentialKeepsItsTimeConstantAtOtherRatesAndOverLostFrames) {
  AxisFilter slow = started_filter(filter_of(FilterKind::exponential));
  AxisFilter fast = slow;
  fast.step(0.01, on_x(1));
  fast.step(0.01, on_x(1));
  fast.step(0.02, on_x(1));
  EXPECT_NEAR(slow.step(0.04, on_x(1))[0], fast.value()[0], 1e-12);
  EXPECT_NEAR(-0.04 / std::log(1 - slow.value()[0]), 0.179, 1e-3) << "s";
}

TEST(AxisFilter, NoneIsNone) {
  AxisFilter filter = started_filter(filter_of(FilterKind::none));
  EXPECT_EQ(filter.step(kFrame, on_x(0.7)), on_x(0.7));
}

TEST(AxisFilter, AxesThatArePushedTogetherStayTogether) {
  for (const FilterKind kind : {FilterKind::exponential, FilterKind::one_euro}) {
    AxisFilter filter = started_filter(filter_of(kind));
    const Vector6 direction = (Vector6() << 1, -0.5, 0.01, 0.3, 0, 0.002).finished();
    for (int i = 0; i < 60; ++i) {
      const Vector6 smooth = filter.step(kFrame, minimum_jerk(i / 30.0) * direction);
      EXPECT_NEAR((smooth - smooth[0] * direction).norm(), 0, 1e-12);
    }
  }
}

/// Standard deviation left of a held push's scatter, after it has settled.
double scatter_left(const FilterOptions& options, const std::function<double(double)>& scatter) {
  AxisFilter filter(options, Vector6::Ones());
  filter.start(on_x(0.5));
  double in = 0;
  double out = 0;
  for (int i = 1; i < 6000; ++i) {
    const double extra = scatter(i * kFrame);
    const double smooth = filter.step(kFrame, on_x(0.5 + extra))[0] - 0.5;
    if (i < 600) continue;
    in += extra * extra;
    out += smooth * smooth;
  }
  return std::sqrt(out / in);
}

/// ms that a hand's push to `size` within `seconds` is late when it is half done.
double lag_ms(const FilterOptions& options, double size, double seconds) {
  AxisFilter filter = started_filter(options);
  double last = 0;
  for (int i = 1; i < 600; ++i) {
    const double smooth = filter.step(kFrame, on_x(size * minimum_jerk(i * kFrame / seconds)))[0];
    if (smooth >= size / 2) {
      const double crossed = (i - (smooth - size / 2) / (smooth - last)) * kFrame;
      return 1e3 * (crossed - seconds / 2);
    }
    last = smooth;
  }
  return 1e9;
}

TEST(AxisFilter, OneEuroHoldsAStillHandStillAndFollowsAFastOne) {
  const FilterOptions euro = filter_of(FilterKind::one_euro);
  const FilterOptions exponential = filter_of(FilterKind::exponential);
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(
      0, 1e-3);  // of full scale: three times the measured noise in Fz
  const auto noise = [&](double) { return normal(random); };
  const auto tremor = [](double t) { return 0.01 * std::sin(2 * std::numbers::pi * 9.3 * t); };
  const double noise_left = scatter_left(euro, noise);
  const double tremor_left = scatter_left(euro, tremor);
  const double brisk = lag_ms(euro, 0.5, 0.5);
  const double slow = lag_ms(euro, 0.1, 1.0);
  std::printf(
      "One Euro, 60 fps: %.2f of noise and %.2f of a tremor left; lag %.0f ms, slowly %.0f "
      "ms. Exponential: %.2f of noise left, lag %.0f and %.0f ms\n",
      noise_left, tremor_left, brisk, slow, scatter_left(exponential, noise),
      lag_ms(exponential, 0.5, 0.5), lag_ms(exponential, 0.1, 1.0));
  EXPECT_NEAR(noise_left, 0.33, 0.05);
  EXPECT_NEAR(tremor_left, 0.33, 0.07);
  EXPECT_LT(350 * 1e-3 * noise_left, 0.2) << "counts of a SpaceMouse, one standard deviation";
  EXPECT_LT(brisk, 12);
  EXPECT_LT(slow, 45);
  EXPECT_GT(lag_ms(exponential, 0.5, 0.5), 100);
}

TEST(AxisFilter, AForgottenAxisDoesNotDragTheOthers) {
  AxisFilter filter = started_filter(filter_of(FilterKind::exponential));
  filter.step(kFrame, Vector6::Ones());
  const double before = filter.value()[1];
  filter.settle(0);
  EXPECT_EQ(filter.value()[0], 1);
  EXPECT_EQ(filter.value()[1], before);
  filter.settle();
  EXPECT_EQ(filter.value(), Vector6::Ones().eval());
}

}  // namespace
}  // namespace tagwrench
