#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/tracker/pixel_template.h"

namespace tagwrench {
namespace {

constexpr int kLeft = 7, kTop = -3, kWidth = 40, kHeight = 31;

template <class Function>
SplineImage sampled(const Function& f) {
  std::vector<float> levels;
  for (int y = kTop; y < kTop + kHeight; ++y) {
    for (int x = kLeft; x < kLeft + kWidth; ++x) levels.push_back(static_cast<float>(f(x, y)));
  }
  return {std::move(levels), kLeft, kTop, kWidth, kHeight};
}

double at(const PixelPolynomial& p, double x, double y) {
  return p[0] + p[1] * x + p[2] * y + p[3] * x * x + p[4] * x * y + p[5] * y * y +
         p[6] * x * x * x + p[7] * x * x * y + p[8] * x * y * y + p[9] * y * y * y;
}

/// A tag's edge, as a lens with a point spread of 1 px shows it, at 30 degrees.
double edge(double x, double y) {
  const double across = 0.866 * (x - 27.3) + 0.5 * (y - 12.1);
  return 40 + 80 * (1 + std::erf(across / std::sqrt(2.0)));
}

/// Symmetric about (27, 12); all orders up to the third.
double cubic(double x, double y) {
  const double u = (x - 27) / 10;
  const double v = (y - 12) / 10;
  return 100 + 20 * u - 15 * v + 30 * u * u - 12 * u * v + 9 * v * v + 7 * u * u * u -
         5 * u * u * v + 11 * u * v * v - 8 * v * v * v;
}

TEST(SplineImage, PassesThroughItsSamplesUpToTheBorder) {
  std::mt19937 random(3);
  std::vector<float> levels(kWidth * kHeight);
  for (float& level : levels) level = static_cast<float>(random() % 256);
  const SplineImage image(levels, kLeft, kTop, kWidth, kHeight);
  for (int y = 2; y < kHeight - 2; ++y) {
    for (int x = 2; x < kWidth - 2; ++x) {
      ASSERT_NEAR(image.level(kLeft + x, kTop + y),
                  levels[static_cast<std::size_t>(y * kWidth + x)], 1e-3)
          << x << ' ' << y;
    }
  }
}

TEST(SplineImage, ReproducesACubicBetweenItsSamples) {
  const SplineImage image = sampled(cubic);
  for (double y = 9; y < 15; y += 0.37) {
    for (double x = 24; x < 30; x += 0.41)
      ASSERT_NEAR(image.level(x, y), cubic(x, y), 2e-3) << x << ' ' << y;
  }
}

TEST(SplineImage, PolynomialOfACubicIsThatCubic) {
  const SplineImage image = sampled(cubic);
  const PixelPolynomial p = image.polynomial(26, 13);
  for (double y = -0.5; y <= 0.5; y += 0.25) {
    for (double x = -0.5; x <= 0.5; x += 0.25)
      EXPECT_NEAR(at(p, x, y), cubic(26 + x, 13 + y), 2e-3) << x << ' ' << y;
  }
}

TEST(SplineImage, PolynomialDescribesABlurredEdgeToAThirdOfAGreyLevel) {
  // The edge is 160 grey levels high; noise is about 2.
  constexpr double kSpline = 0.3, kPolynomial = 0.35;  // grey levels
  const SplineImage image = sampled(edge);
  double spline = 0, polynomial = 0;
  for (int row = 9; row < 16; ++row) {
    for (int column = 23; column < 32; ++column) {
      const PixelPolynomial p = image.polynomial(column, row);
      for (double y = -0.5; y <= 0.5; y += 0.125) {
        for (double x = -0.5; x <= 0.5; x += 0.125) {
          const double level = image.level(column + x, row + y);
          spline = std::max(spline, std::abs(level - edge(column + x, row + y)));
          polynomial = std::max(polynomial, std::abs(level - at(p, x, y)));
        }
      }
    }
  }
  EXPECT_LT(spline, kSpline);
  EXPECT_LT(polynomial, kPolynomial);
}

}  // namespace
}  // namespace tagwrench
