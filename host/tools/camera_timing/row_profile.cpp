// What bands of rows see of a flashing light.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {
namespace {

constexpr double kWhite_counts = 235;   // mean of a pixel that is sometimes clipped
constexpr double kMinRise_counts = 12;  // of a pixel that the LED lights
constexpr double kMinUsed = 0.05;       // of the picture
constexpr double kMaxSaturated = 0.5;   // of the picture
constexpr double kMaxAmbient = 0.8;
constexpr int kMinBandPixels = 64;

constexpr double kMin = 20e-6;  // s; less is no different from an instant, but for rounding

}  // namespace

RowProfiler::RowProfiler(int width, int height) : width_(width), height_(height) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  lit_.counts.resize(pixels);
  dark_.counts.resize(pixels);
  used_.resize(pixels);
}

void RowProfiler::learn(const ImageView& image, Sum& sum) const {
  std::size_t i = 0;
  for (int row = 0; row < height_; ++row) {
    const std::uint8_t* pixels = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    for (int column = 0; column < width_; ++column, ++i) sum.counts[i] += pixels[column];
  }
  ++sum.pictures;
}

std::string RowProfiler::choose() {
  if (lit_.pictures == 0 || dark_.pictures == 0)
    return "no pictures came with the LED on and off: is the camera streaming?";
  double lit = 0, dark = 0, rise = 0;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    const double bright = lit_.mean(i), dim = dark_.mean(i);
    rise = std::max(rise, bright - dim);
    saturated_count_ += bright >= kWhite_counts ? 1 : 0;
    used_[i] = bright < kWhite_counts && bright - dim >= kMinRise_counts ? 1 : 0;
    used_count_ += used_[i];
    lit += used_[i] * bright;
    dark += used_[i] * dim;
  }
  if (saturated_fraction() > kMaxSaturated) {
    return fmt::format(
        "{:.0f} % of the picture is white when the LED is on: shorten the exposure or dim the room",
        100 * saturated_fraction());
  }
  if (used_fraction() < kMinUsed) {
    return fmt::format(
        "the LED does not show in the picture (it makes no pixel brighter by more than {:.0f} grey "
        "levels, or too few): is it before this camera, wired and lit?",
        rise);
  }
  ambient_part_ = lit > 0 ? dark / lit : 0;
  if (ambient_part_ > kMaxAmbient) {
    return fmt::format(
        "{:.0f} % of the light is not the LED's: shade the sensor, or shorten the exposure",
        100 * ambient_part_);
  }
  make_bands();
  return {};
}

// A band's place and height are those of its light: rows have no height in time, and the brighter
// ones count for more.
void RowProfiler::make_bands() {
  const int bands = std::min(kMaxBands, height_);
  for (int band = 0; band < bands; ++band) {
    const int first = band * height_ / bands, last = (band + 1) * height_ / bands;
    double bright = 0, dim = 0, rows = 0, squares = 0;
    int count = 0;
    for (int row = first; row < last; ++row) {
      const double offset = row - first;
      for (int column = 0; column < width_; ++column) {
        const std::size_t i = static_cast<std::size_t>(row) * width_ + column;
        if (used_[i] == 0) continue;
        const double rise = lit_.mean(i) - dark_.mean(i);
        bright += lit_.mean(i);
        dim += dark_.mean(i);
        rows += rise * offset;
        squares += rise * offset * offset;
        ++count;
      }
    }
    if (count < kMinBandPixels) continue;
    const double mean = rows / (bright - dim);
    const double variance = std::max(squares / (bright - dim) - mean * mean, 0.0);
    const double half = std::sqrt(3 * variance) / height_;  // an even band that scatters as much
    const double middle = (first + mean + 0.5) / height_;
    first_rows_.push_back(first);
    last_rows_.push_back(last);
    bands_.push_back({middle - half, middle + half});
    lit_profile_.push_back(bright / count);
    dark_profile_.push_back(dim / count);
  }
}

RowProfile RowProfiler::measure(const ImageView& image) const {
  RowProfile profile(bands_.size());
  for (std::size_t band = 0; band < bands_.size(); ++band) {
    std::uint64_t sum = 0, count = 0;
    for (int row = first_rows_[band]; row < last_rows_[band]; ++row) {
      const std::uint8_t* pixels = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
      const std::uint8_t* used = used_.data() + static_cast<std::size_t>(row) * width_;
      for (int column = 0; column < width_; ++column) {
        sum += static_cast<std::uint64_t>(used[column]) * pixels[column];
        count += used[column];
      }
    }
    profile[band] = static_cast<double>(sum) / static_cast<double>(count);
  }
  return profile;
}

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
           (edges_[edge] - edges_.front()) * buckets_per_second_ < static_cast<double>(i))
      ++edge;
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
  const double first = band.first - 0.5, last = band.last - 0.5;
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
