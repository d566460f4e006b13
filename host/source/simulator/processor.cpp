#include "host/source/simulator/processor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::sim {
namespace {

constexpr float kWhite = 255;

std::vector<float> gaussian(double sigma) {
  if (sigma <= 0) return {};
  std::vector<float> weights(static_cast<std::size_t>(std::ceil(3 * sigma)) + 1);
  float sum = 0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    weights[k] = static_cast<float>(std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma)));
    sum += (k == 0 ? 1.0F : 2.0F) * weights[k];
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

std::uint8_t to_byte(float level) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0F, kWhite)));
}

}  // namespace

Processor::Processor(const Processing& settings, int width, int height)
    : settings_(settings),
      width_(width),
      height_(height),
      does_anything_(settings.exposure_hunt > 0 || settings.demosaicing ||
                     settings.spatial_counts > 0 || settings.temporal > 0 || settings.gamma != 1 ||
                     settings.contrast > 0 || settings.sharpening > 0) {
  if (!does_anything_) return;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (auto* picture : {&picture_, &other_}) picture->resize(pixels);
  if (settings.temporal > 0) before_.resize(pixels);
  // Bilinear: a missing green is the mean of its neighbours, so that brightness is a tent wide.
  if (settings.demosaicing) demosaicing_ = {0.5F, 0.25F};
  blur_ = gaussian(settings.sharpening_radius_px);
  for (std::size_t level = 0; level < tone_.size(); ++level) {
    const double curved = std::pow(static_cast<double>(level) / kWhite, settings.gamma);
    // A smooth step, mixed in: steeper in the middle, flat at black and white.
    const double step = curved * curved * (3 - 2 * curved);
    tone_[level] =
        static_cast<float>(kWhite * ((1 - settings.contrast) * curved + settings.contrast * step));
  }
}

double Processor::exposure_gain(double time) const noexcept {
  return 1 + settings_.exposure_hunt *
                 std::sin(2 * std::numbers::pi * settings_.exposure_hunt_hz * time);
}

void Processor::apply(std::uint8_t* pixels, double time) noexcept {
  if (!does_anything_) return;
  const auto gain = static_cast<float>(exposure_gain(time));
  for (std::size_t i = 0; i < picture_.size(); ++i)
    picture_[i] = std::min(kWhite, gain * static_cast<float>(pixels[i]));
  if (settings_.demosaicing) {
    smooth_rows_and_columns(demosaicing_);
    picture_.swap(other_);
  }
  if (settings_.spatial_counts > 0) reduce_noise_in_space();
  if (settings_.temporal > 0) reduce_noise_in_time();
  for (float& level : picture_) {
    const float at = std::clamp(level, 0.0F, kWhite);
    const auto below = static_cast<std::size_t>(std::min(at, kWhite - 1));
    const float part = at - static_cast<float>(below);
    level = tone_[below] + part * (tone_[below + 1] - tone_[below]);
  }
  if (settings_.sharpening > 0) sharpen();
  for (std::size_t i = 0; i < picture_.size(); ++i) pixels[i] = to_byte(picture_[i]);
}

/// picture_ convolved with an even kernel, into other_.
void Processor::smooth_rows_and_columns(const std::vector<float>& kernel) noexcept {
  const int reach = static_cast<int>(kernel.size()) - 1;
  const auto at = [this](int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(column);
  };
  // Along columns into other_, then along its rows, of which what lies to the left is kept aside.
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      float sum = kernel[0] * picture_[at(row, column)];
      for (int k = 1; k <= reach; ++k)
        sum += kernel[static_cast<std::size_t>(k)] *
               (picture_[at(std::max(row - k, 0), column)] +
                picture_[at(std::min(row + k, height_ - 1), column)]);
      other_[at(row, column)] = sum;
    }
  }
  constexpr int kMaxReach = 16;
  std::array<float, kMaxReach> left{};
  for (int row = 0; row < height_; ++row) {
    left.fill(other_[at(row, 0)]);
    for (int column = 0; column < width_; ++column) {
      const float here = other_[at(row, column)];
      float sum = kernel[0] * here;
      for (int k = 1; k <= reach; ++k)
        sum += kernel[static_cast<std::size_t>(k)] *
               (left[static_cast<std::size_t>(k - 1)] +
                other_[at(row, std::min(column + k, width_ - 1))]);
      std::rotate(left.rbegin(), left.rbegin() + 1, left.rend());
      left[0] = here;
      other_[at(row, column)] = sum;
    }
  }
}

/// The mean of those of a pixel's eight neighbours that are like it (sigma filter: Lee, Computer
/// Vision, Graphics and Image Processing 24, 255, 1983).
void Processor::reduce_noise_in_space() noexcept {
  const auto like = static_cast<float>(settings_.spatial_counts);
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const auto at = [&](int r, int c) {
        return picture_[static_cast<std::size_t>(std::clamp(r, 0, height_ - 1)) *
                            static_cast<std::size_t>(width_) +
                        static_cast<std::size_t>(std::clamp(c, 0, width_ - 1))];
      };
      const float here = at(row, column);
      float sum = 0, count = 0;
      for (int r = row - 1; r <= row + 1; ++r) {
        for (int c = column - 1; c <= column + 1; ++c) {
          const float there = at(r, c);
          if (std::abs(there - here) > like) continue;
          sum += there;
          count += 1;
        }
      }
      other_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
             static_cast<std::size_t>(column)] = sum / count;
    }
  }
  picture_.swap(other_);
}

/// A pixel that is like it was keeps `temporal` of what it was; one that has changed does not.
void Processor::reduce_noise_in_time() noexcept {
  const auto like = static_cast<float>(settings_.temporal_counts);
  const auto keep = static_cast<float>(settings_.temporal);
  for (std::size_t i = 0; has_before_ && i < picture_.size(); ++i) {
    const float change = before_[i] - picture_[i];
    const float part = std::max(0.0F, 1 - std::abs(change) / like);
    picture_[i] += keep * part * change;
  }
  before_ = picture_;
  has_before_ = true;
}

void Processor::sharpen() noexcept {
  smooth_rows_and_columns(blur_);
  const auto amount = static_cast<float>(settings_.sharpening);
  for (std::size_t i = 0; i < picture_.size(); ++i)
    picture_[i] += amount * (picture_[i] - other_[i]);
}

}  // namespace tagwrench::sim
