// A camera before a flashing light, row by row and by plain overlap of intervals: no sums or
// integrals that the estimator has.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench::test {

struct FlashedCamera {
  double period = 1 / 24.87;
  double announced = 0.040;
  double latency = 0.023;
  double jitter = 0.001;  ///< s, standard deviation; an exponential
  double readout = 0.018;
  double exposure = 0.004;
  double stale = 0;  ///< share
  double lost = 0;   ///< share
  double bend = 0;   ///< of the response: half the light gives 1/2 + bend of the brightness
  double noise_counts = 0.05;  ///< of a band, standard deviation
  double start = 5000.0;       ///< host clock, s
  int frames = 250;
  unsigned seed = 1;
};

struct FlashedTruth {
  std::vector<double> exposed;
  std::vector<bool> stale;
  int lost = 0;  ///< between the first and the last frame delivered
};

constexpr int kRows = 240;
constexpr int kBands = 48;

/// Light between two times, as a share of them.
inline double overlap(const std::vector<double>& edges, double from, double to) {
  double on = 0;
  auto edge = std::upper_bound(edges.begin(), edges.end(), from);
  std::size_t k = static_cast<std::size_t>(edge - edges.begin());
  double at = from;
  while (at < to) {
    const double until = k < edges.size() ? std::min(edges[k], to) : to;
    if (k % 2 == 1) on += until - at;
    at = until;
    ++k;
  }
  return on / (to - from);
}

inline CameraTimingInput flash(const FlashedCamera& camera, FlashedTruth& truth) {
  std::mt19937_64 random(camera.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, 1);
  std::exponential_distribution<double> exponential(1);
  CameraTimingInput input;
  input.bit = bit_period_for(camera.announced);
  input.period = camera.announced;
  const double length = camera.frames * camera.period * 1.2 + 1;
  bool light = false;
  for (double t = camera.start; t < camera.start + length; t += input.bit) {
    const bool next = uniform(random) < 0.5;
    if (next != light) input.edges.push_back(t);
    light = next;
  }
  for (int b = 0; b < kBands; ++b) {
    // A row has no height in time: five of them reach as far as this.
    const double half = 0.5 / kBands * std::sqrt(1 - 1.0 / 25), middle = (b + 0.5) / kBands;
    input.bands.push_back({middle - half, middle + half});
    input.dark.push_back(3 + 0.05 * b);
    input.lit.push_back(110 + 30 * std::sin(0.1 * b));
  }
  // The references are off by some per cent: lamps are not that steady.
  std::vector<double> gain(kBands), dark(kBands);
  for (int b = 0; b < kBands; ++b) {
    dark[b] = input.dark[b] + 0.3;
    gain[b] = 1.04 * (input.lit[b] - input.dark[b]);
  }
  double exposed = camera.start + 0.7 + camera.period * uniform(random);
  std::uint32_t dropped = 0;
  RowProfile picture;
  double shown = 0;
  while (static_cast<int>(input.frames.size()) < camera.frames) {
    exposed += camera.period;
    if (!input.frames.empty() && uniform(random) < camera.lost) {
      ++dropped;
      continue;
    }
    const bool stale = !picture.empty() && uniform(random) < camera.stale;
    if (!stale) {
      shown = exposed;
      picture.assign(kBands, 0.0);
      for (int row = 0; row < kRows; ++row) {
        const double middle = exposed + ((row + 0.5) / kRows - 0.5) * camera.readout;
        const int b = row * kBands / kRows;
        const double lit =
            overlap(input.edges, middle - 0.5 * camera.exposure, middle + 0.5 * camera.exposure);
        const double bent = lit + 4 * camera.bend * lit * (1 - lit);
        picture[b] += (dark[b] + gain[b] * bent) / (kRows / kBands);
      }
      for (double& value : picture) value += camera.noise_counts * normal(random);
    }
    const double delay = camera.latency + camera.jitter * (exponential(random) - 1);
    input.frames.push_back({exposed + delay, dropped, picture});
    truth.lost += static_cast<int>(dropped);
    dropped = 0;
    truth.exposed.push_back(shown);
    truth.stale.push_back(stale);
  }
  return input;
}

}  // namespace tagwrench::test
