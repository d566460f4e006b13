#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {
namespace {

std::vector<double> random_edges() {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> bits(1, 5);
  std::vector<double> edges;
  for (double t = 100; t < 110; t += 0.0026 * bits(random)) edges.push_back(t);
  return edges;
}

/// By adding up a fine comb of instants.
double summed(const std::vector<double>& edges, const RowBand& band, const ExposureTimes& times) {
  constexpr int kRows = 200, kInstants = 400;
  int on = 0;
  for (int r = 0; r < kRows; ++r) {
    const double place = band.first + (band.last - band.first) * (r + 0.5) / kRows - 0.5;
    for (int k = 0; k < kInstants; ++k) {
      const double t =
          times.middle + place * times.readout + ((k + 0.5) / kInstants - 0.5) * times.exposure;
      on += (std::upper_bound(edges.begin(), edges.end(), t) - edges.begin()) % 2;
    }
  }
  return on / double(kRows * kInstants);
}

TEST(LightSignal, MeanIsThatOfAllInstantsAndRows) {
  const std::vector<double> edges = random_edges();
  const LightSignal light(edges);
  for (const double readout : {0.018, -0.018, 0.0, 1e-5, 0.0005}) {
    for (const double exposure : {0.0003, 0.004, 0.02}) {
      for (int i = 0; i < 10; ++i) {
        const ExposureTimes times{99.995 + i * 1.1137, readout, exposure};
        const RowBand band{0.1 * (i % 9), 0.1 * (i % 9) + 0.1};
        EXPECT_NEAR(light.seen(band, times).mean, summed(edges, band, times), 4e-3)
            << readout << " " << exposure << " " << i;
      }
    }
  }
}

TEST(LightSignal, DerivativesAreThoseOfTheMean) {
  const LightSignal light(random_edges());
  constexpr double kStep = 1e-7;
  for (const double readout : {0.018, -0.018, 0.00001}) {
    for (int i = 0; i < 20; ++i) {
      const ExposureTimes times{101.0 + i * 0.4137, readout, 0.0041};
      const RowBand band{0.04 * i, 0.04 * i + 0.04};
      const SeenLight seen = light.seen(band, times);
      const auto mean = [&](double dm, double dr, double de) {
        return light.seen(band, {times.middle + dm, times.readout + dr, times.exposure + de}).mean;
      };
      EXPECT_NEAR(seen.by_middle, (mean(kStep, 0, 0) - mean(-kStep, 0, 0)) / (2 * kStep), 0.5);
      EXPECT_NEAR(seen.by_readout, (mean(0, kStep, 0) - mean(0, -kStep, 0)) / (2 * kStep), 0.5);
      EXPECT_NEAR(seen.by_exposure, (mean(0, 0, kStep) - mean(0, 0, -kStep)) / (2 * kStep), 0.5);
    }
  }
}

TEST(LightSignal, IsDarkBeforeTheFirstEdge) {
  const LightSignal light({10.0, 10.5});
  EXPECT_NEAR(light.seen({0, 1}, {9.0, 0.018, 0.004}).mean, 0.0, 1e-12);
  EXPECT_NEAR(light.seen({0, 1}, {10.25, 0.018, 0.004}).mean, 1.0, 1e-12);
  EXPECT_NEAR(light.seen({0, 1}, {12.0, 0.018, 0.004}).mean, 0.0, 1e-10);
}

}  // namespace
}  // namespace tagwrench
