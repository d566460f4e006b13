// What a camera's image processor does to pictures: each step by itself, as said.
#include "host/source/simulator/processor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace tagwrench::sim {
namespace {

constexpr int kWidth = 64, kHeight = 48;
using Pixels = std::vector<std::uint8_t>;

Pixels flat(std::uint8_t level) {
  return Pixels(static_cast<std::size_t>(kWidth) * kHeight, level);
}

/// Dark to the left, bright from the middle on.
Pixels edge(std::uint8_t dark, std::uint8_t bright) {
  Pixels pixels = flat(dark);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (i % kWidth >= kWidth / 2) pixels[i] = bright;
  return pixels;
}

Pixels noisy(std::uint8_t level, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(level, sigma);
  Pixels pixels = flat(level);
  for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(std::lround(normal(random)));
  return pixels;
}

double variance(const Pixels& pixels) {
  const double mean = std::accumulate(pixels.begin(), pixels.end(), 0.0) / pixels.size();
  double sum = 0;
  for (const std::uint8_t pixel : pixels) sum += (pixel - mean) * (pixel - mean);
  return sum / static_cast<double>(pixels.size());
}

std::uint8_t at(const Pixels& pixels, int column) {
  return pixels[static_cast<std::size_t>(kHeight / 2 * kWidth + column)];
}

Pixels processed(const Processing& settings, Pixels pixels) {
  Processor(settings, kWidth, kHeight).apply(pixels.data(), 0);
  return pixels;
}

TEST(Processor, OfAScenarioThatNamesNoneTouchesNothing) {
  const Pixels picture = noisy(120, 9, 1);
  EXPECT_EQ(processed({}, picture), picture);
}

TEST(Processor, GammaBrightensWhatLiesBetweenBlackAndWhite) {
  const Processing video{.gamma = 0.5};
  EXPECT_EQ(at(processed(video, flat(0)), 5), 0);
  EXPECT_EQ(at(processed(video, flat(255)), 5), 255);
  EXPECT_NEAR(at(processed(video, flat(64)), 5), 255 * std::sqrt(64.0 / 255), 1);
}

TEST(Processor, ContrastIsSteeperInTheMiddleAndLeavesItThere) {
  const Processing steep{.contrast = 0.5};
  const auto level = [&](std::uint8_t in) { return at(processed(steep, flat(in)), 5); };
  EXPECT_NEAR(level(128), 128, 1);
  // A smooth step is 1.5 times as steep in its middle.
  EXPECT_NEAR(level(148) - level(108), 1.25 * 40, 2);
  EXPECT_EQ(level(0), 0);
}

TEST(Processor, SharpeningOvershootsByItsAmountTimesWhatTheGaussianTakes) {
  const Processing sharp{.sharpening = 1.0, .sharpening_radius_px = 1.0};
  const Pixels out = processed(sharp, edge(60, 160));
  // Beside a step of 100 a Gaussian of 1 px takes 100 Phi(-0.5) = 30.9 of the first pixel.
  EXPECT_NEAR(at(out, kWidth / 2), 160 + 30.9, 1.5);
  EXPECT_NEAR(at(out, kWidth / 2 - 1), 60 - 30.9, 1.5);
  EXPECT_EQ(at(out, 4), 60);
  EXPECT_EQ(at(out, kWidth - 4), 160);
}

TEST(Processor, DemosaicingMakesAnEdgeATentWide) {
  const Pixels out = processed({.demosaicing = true}, edge(0, 200));
  EXPECT_EQ(at(out, kWidth / 2 - 2), 0);
  EXPECT_EQ(at(out, kWidth / 2 - 1), 50);
  EXPECT_EQ(at(out, kWidth / 2), 150);
  EXPECT_EQ(at(out, kWidth / 2 + 1), 200);
}

TEST(Processor, NoiseReductionInSpaceAveragesNineAndSparesEdges) {
  const Processing smooth{.spatial_counts = 60};
  EXPECT_NEAR(variance(processed(smooth, noisy(120, 6, 2))), 36.0 / 9 + 1.0 / 12, 1);
  const Pixels step = edge(40, 200);
  EXPECT_EQ(processed(smooth, step), step);
}

TEST(Processor, NoiseReductionInTimeKeepsWhatHasNotChangedAndLetsGoOfWhatHas) {
  const Processing slow{.temporal = 0.8, .temporal_counts = 40};
  Processor processor(slow, kWidth, kHeight);
  Pixels picture;
  for (unsigned i = 0; i < 30; ++i) {
    picture = noisy(120, 2, 10 + i);
    processor.apply(picture.data(), 0);
  }
  // Recursive averaging with weight 0.8 of the past: (1 - 0.8) / (1 + 0.8) of the variance, a
  // little more as little changes still change, and rounding.
  EXPECT_LT(variance(picture), 0.3 * 4 + 1.0 / 12);
  Pixels jumped = flat(200);
  processor.apply(jumped.data(), 0);
  EXPECT_EQ(jumped, flat(200));
  Pixels crept = flat(204);
  processor.apply(crept.data(), 0);
  EXPECT_NEAR(at(crept, 5), 204 - 0.8 * 0.9 * 4, 0.6) << "what changes by little drags behind";
}

TEST(Processor, AutoExposureThatHuntsSwingsTheBrightnessWithItsPeriod) {
  const Processing hunting{.exposure_hunt = 0.1, .exposure_hunt_hz = 0.5};
  Processor processor(hunting, kWidth, kHeight);
  const auto level = [&](double time) {
    Pixels picture = flat(100);
    processor.apply(picture.data(), time);
    return at(picture, 5);
  };
  EXPECT_EQ(level(0), 100);
  EXPECT_EQ(level(0.5), 110);
  EXPECT_EQ(level(1.5), 90);
  EXPECT_EQ(level(2.5), 110);
}

}  // namespace
}  // namespace tagwrench::sim
