#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/motion/shaping.h"

namespace tagwrench {
namespace {

CurveOptions curve_through(std::initializer_list<CurvePoint> points) {
  CurveOptions o;
  o.kind = CurveKind::points;
  for (const CurvePoint& point : points) o.points[o.count++] = point;
  return o;
}

TEST(ResponseCurve, LinearIsStraightAndKeepsWithinItsEnds) {
  const ResponseCurve curve{CurveOptions{}};
  EXPECT_EQ(curve(0.37), 0.37);
  EXPECT_EQ(curve(-1), 0);
  EXPECT_EQ(curve(1.5), 1);
}

TEST(ResponseCurve, PowerIsAPower) {
  const ResponseCurve curve({.kind = CurveKind::power, .power = 1.6});
  EXPECT_DOUBLE_EQ(curve(0.5), std::pow(0.5, 1.6));
  EXPECT_EQ(curve(0), 0);
  EXPECT_EQ(curve(1), 1);
}

TEST(ResponseCurve, TwoPointsAreALine) {
  const ResponseCurve curve(curve_through({{0, 0}, {1, 0.8}}));
  for (double x = 0; x <= 1; x += 0.1) EXPECT_NEAR(curve(x), 0.8 * x, 1e-12);
}

TEST(ResponseCurve, PointsOnALineMakeALine) {
  const ResponseCurve curve(curve_through({{0, 0}, {0.1, 0.1}, {0.55, 0.55}, {1, 1}}));
  for (double x = 0; x <= 1; x += 0.01) EXPECT_NEAR(curve(x), x, 1e-12);
}

TEST(ResponseCurve, AFlatPieceIsFlat) {
  const ResponseCurve curve(curve_through({{0, 0}, {0.3, 0.5}, {0.6, 0.5}, {1, 1}}));
  for (double x = 0.3; x <= 0.6; x += 0.01) EXPECT_DOUBLE_EQ(curve(x), 0.5);
}

TEST(ResponseCurve, PassesThroughItsPointsNeverFallsAndNeverOvershoots) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 500; ++round) {
    CurveOptions o;
    o.kind = CurveKind::points;
    o.count = 2 + random() % (kMaxCurvePoints - 1);
    for (std::size_t i = 1; i < o.count; ++i) {
      // Steps of very different sizes, some of them flat: where plain cubics overshoot.
      o.points[i].in = o.points[i - 1].in + 0.001 + std::pow(unit(random), 4);
      o.points[i].out = o.points[i - 1].out + (random() % 4 == 0 ? 0 : std::pow(unit(random), 8));
    }
    const double width = o.points[o.count - 1].in;
    const double height = std::max(o.points[o.count - 1].out, 1.0);
    for (CurvePoint& point : o.points) point = {point.in / width, point.out / height};
    o.points[o.count - 1].in = 1;
    const ResponseCurve curve(o);
    for (std::size_t i = 0; i < o.count; ++i)
      EXPECT_NEAR(curve(o.points[i].in), o.points[i].out, 1e-12);
    double last = 0;
    for (int i = 0; i <= 2000; ++i) {
      const double out = curve(i / 2000.0);
      ASSERT_GE(out, last - 1e-14) << "round " << round << " at " << i / 2000.0;
      ASSERT_LE(out, o.points[o.count - 1].out + 1e-14);
      last = out;
    }
  }
}

TEST(ResponseCurve, HasNoCorners) {
  const ResponseCurve curve(curve_through({{0, 0}, {0.5, 0.2}, {1, 1}}));
  constexpr double kNear = 1e-6;
  const double before = (curve(0.5) - curve(0.5 - kNear)) / kNear;
  const double after = (curve(0.5 + kNear) - curve(0.5)) / kNear;
  EXPECT_NEAR(before, after, 1e-4);
  EXPECT_NEAR(before, 2 * 0.4 * 1.6 / (0.4 + 1.6), 1e-4) << "the harmonic mean of both slopes";
}

}  // namespace
}  // namespace tagwrench
