#include "host/tools/camera_timing/light_signal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tagwrench {
namespace {

constexpr double kMin = 20e-6;  // s; less is no different from an instant, but for rounding

}  // namespace

LightSignal::LightSignal(std::vector<double> edges) : edges_(std::move(edges)) {
  if (edges_.empty()) edges_.push_back(0);
  once_.resize(edges_.size());
  twice_.resize(edges_.size());
  for (std::size_t i = 1; i < edges_.size(); ++i) {
    const double length = edges_[i] - edges_[i - 1];
    const double light = i % 2 == 1 ? 0.5 : -0.5;
    once_[i] = once_[i - 1] + light * length;
    twice_[i] = twice_[i - 1] + once_[i - 1] * length + 0.5 * light * length * length;
  }
  const double span = edges_.back() - edges_.front();
  const auto count = static_cast<double>(edges_.size());
  buckets_per_second_ = span > 0 ? count / span : 0;
  std::size_t edge = 0;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    while (edge < edges_.size() &&
           (edges_[edge] - edges_.front()) * buckets_per_second_ < static_cast<double>(i)) {
      ++edge;
    }
    buckets_.push_back(edge);
  }
}

/// Number of edges at or before `time`.
std::size_t LightSignal::edges_until(double time) const noexcept {
  if (time < edges_.front()) return 0;
  const double place = (time - edges_.front()) * buckets_per_second_;
  const auto bucket = std::min(static_cast<std::size_t>(place), buckets_.size() - 1);
  std::size_t edge = buckets_[bucket];
  while (edge < edges_.size() && edges_[edge] <= time) ++edge;
  return edge;
}

// Less 1/2, so that the integrals stay small and lose nothing to rounding.
LightSignal::Integrals LightSignal::at(double time) const noexcept {
  const std::size_t edge = edges_until(time);
  const std::size_t from = edge == 0 ? 0 : edge - 1;
  const double light = edge % 2 == 1 ? 0.5 : -0.5;
  const double since = time - edges_[from];
  return {light, once_[from] + light * since,
          twice_[from] + once_[from] * since + 0.5 * light * since * since};
}

// The rows of a band are exposed one after the other: the mean over band and exposure is a second
// difference of the signal's second integral.
SeenLight LightSignal::seen(const RowBand& band, const ExposureTimes& times) const noexcept {
  const double first = band.first - 0.5;
  const double last = band.last - 0.5;
  const double exposure = std::max(times.exposure, kMin);
  const double half = 0.5 * exposure;
  const double width = times.readout * (last - first);
  if (std::abs(width) < kMin) {
    const double place = 0.5 * (first + last);
    const double centre = times.middle + times.readout * place;
    const Integrals begin = at(centre - half);
    const Integrals end = at(centre + half);
    const double mean = (end.once - begin.once) / exposure;
    const double slope = (end.light - begin.light) / exposure;
    return {0.5 + mean, slope, place * slope, (0.5 * (end.light + begin.light) - mean) / exposure};
  }
  const double a = times.middle + times.readout * first;
  const double b = times.middle + times.readout * last;
  const Integrals a0 = at(a - half), a1 = at(a + half), b0 = at(b - half), b1 = at(b + half);
  const double scale = 1 / (exposure * width);
  const double mean = scale * (b1.twice - a1.twice - b0.twice + a0.twice);
  return {0.5 + mean, scale * (b1.once - a1.once - b0.once + a0.once),
          scale * (last * (b1.once - b0.once) - first * (a1.once - a0.once)) - mean / times.readout,
          scale * 0.5 * (b1.once - a1.once + b0.once - a0.once) - mean / exposure};
}

}  // namespace tagwrench
