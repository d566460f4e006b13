#include "host/tools/camera_timing/row_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr double kWhite_counts = 235;   // mean of a pixel that is sometimes clipped
constexpr double kMinRise_counts = 12;  // of a pixel that the LED lights
constexpr double kMinUsed = 0.05;       // of the picture
constexpr double kMaxSaturated = 0.5;   // of the picture
constexpr double kMaxAmbient = 0.8;
constexpr int kMinBandPixels = 64;

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

double RowProfiler::used_fraction() const noexcept {
  return static_cast<double>(used_count_) / static_cast<double>(used_.size());
}

double RowProfiler::saturated_fraction() const noexcept {
  return static_cast<double>(saturated_count_) / static_cast<double>(used_.size());
}

// A band's place and height are those of its light: rows have no height in time, and the brighter
// ones count for more.
void RowProfiler::make_bands() {
  const int bands = std::min(kMaxBands, height_);
  for (int band = 0; band < bands; ++band) {
    const int first = band * height_ / bands;
    const int last = (band + 1) * height_ / bands;
    double bright = 0, dim = 0, rows = 0, squares = 0;
    int count = 0;
    for (int row = first; row < last; ++row) {
      const double offset = row - first;
      for (int column = 0; column < width_; ++column) {
        const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                              static_cast<std::size_t>(column);
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
      const std::uint8_t* used =
          used_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
      for (int column = 0; column < width_; ++column) {
        sum += static_cast<std::uint64_t>(used[column]) * pixels[column];
        count += used[column];
      }
    }
    profile[band] = static_cast<double>(sum) / static_cast<double>(count);
  }
  return profile;
}

}  // namespace tagwrench
