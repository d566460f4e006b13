// The renderer's inner loops: texel lookups, compositing, point spread, noise. One row at a time,
// written so that the compiler turns the arithmetic into vector code.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/source/simulator/renderer.h"

namespace tagwrench::sim {
namespace {

// GCC's and clang's, which every processor has: reflectance and coverage of one texel, and those of
// its neighbour to the right.
using OneTexel [[gnu::vector_size(8)]] = float;
using TwoTexels [[gnu::vector_size(16)]] = float;

// Where in a pixel each of its 2 x 2 samples lies.
struct Offset {
  float x, y;
};
constexpr Offset kOffsets[4] = {{-0.25F, -0.25F}, {0.25F, -0.25F}, {-0.25F, 0.25F}, {0.25F, 0.25F}};

// Along a side of the pixel, where the exposure is even: with 2 an edge's place in the picture
// depends on its place in the pixel by some hundredths of a pixel, which is the size of what a good
// tracker leaves.
constexpr int kEvenSamples = 5;

// Which quarter of the exposure each sample of a pixel sees. One order cannot be free of a drift
// across both axes of the pixel (a moving edge would reach one half of every pixel first and be
// seen displaced), so four orders take turns whose drifts cancel over neighbours: up, right, down,
// left.
constexpr int kOrders[4][4] = {{0, 1, 3, 2}, {0, 3, 1, 2}, {3, 2, 0, 1}, {3, 0, 2, 1}};

/// Bilinear, of what lies (u, v) texels from the first.
OneTexel texel_between(const Texture& t, float u, float v) {
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  const float fu = u - static_cast<float>(column);
  const float fv = v - static_cast<float>(row);
  const Texel* texel = t.texels.data() + row * t.width + column;
  TwoTexels top, bottom;
  std::memcpy(&top, texel, sizeof top);
  std::memcpy(&bottom, texel + t.width, sizeof bottom);
  const TwoTexels left = __builtin_shufflevector(top, bottom, 0, 1, 4, 5);
  const TwoTexels right = __builtin_shufflevector(top, bottom, 2, 3, 6, 7);
  const TwoTexels rows = left + fu * (right - left);
  const OneTexel upper = __builtin_shufflevector(rows, rows, 0, 1);
  const OneTexel lower = __builtin_shufflevector(rows, rows, 2, 3);
  return upper + fv * (lower - upper);
}

// Texel coordinates of rays, kept inside of the texture (whose outermost texels are empty or
// continue the plate).
void find_texels(const std::array<float, 9>& h, const float* x, const float* y, int count,
                 float max_u, float max_v, float* u, float* v) {
  const float a = h[0], b = h[1], c = h[2], d = h[3], e = h[4], f = h[5], p = h[6], q = h[7],
              r = h[8];
  for (int i = 0; i < count; ++i) {
    const float w = 1.0F / (p * x[i] + q * y[i] + r);
    const float uu = (a * x[i] + b * y[i] + c) * w;
    const float vv = (d * x[i] + e * y[i] + f) * w;
    // In this order of arguments a number that is not one becomes 0.
    u[i] = std::min(std::max(0.0F, uu), max_u);
    v[i] = std::min(std::max(0.0F, vv), max_v);
  }
}

}  // namespace

void Renderer::draw_opaque(const View& view, int row) noexcept {
  const Texture& t = *view.texture;
  const int width = camera_.width_px;
  float* u = scratch_.u.data();
  float* v = scratch_.v.data();
  find_texels(view.instants[0], rays_.x(row), rays_.y(row), width,
              static_cast<float>(t.width) - 1.01F, static_cast<float>(t.height) - 1.01F, u, v);
  float* out = scene_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  for (int i = 0; i < width; ++i) out[i] = view.shade * texel_between(t, u[i], v[i])[0];
}

void Renderer::add_samples(const Texture& t, const TexelFromRay& h, int count, int first,
                           int stride) noexcept {
  float* u = scratch_.u.data();
  float* v = scratch_.v.data();
  find_texels(h, scratch_.x.data(), scratch_.y.data(), count, static_cast<float>(t.width) - 1.01F,
              static_cast<float>(t.height) - 1.01F, u, v);
  Texel* to = scratch_.sum.data() + first;
  for (int i = 0; i < count; ++i, to += stride) {
    OneTexel sum;
    std::memcpy(&sum, to, sizeof sum);
    sum += texel_between(t, u[i], v[i]);
    std::memcpy(static_cast<void*>(to), &sum, sizeof sum);
  }
}

void Renderer::draw_coarse(const View& view, int row) noexcept {
  const int count = view.right - view.left;
  if (count <= 0) return;
  std::copy_n(rays_.x(row) + view.left, count, scratch_.x.begin());
  std::copy_n(rays_.y(row) + view.left, count, scratch_.y.begin());
  std::fill_n(scratch_.sum.begin(), count, Texel{});
  add_samples(*view.texture, view.instants[0], count, 0, 1);
  composite(view, row, 1.0F);
}

void Renderer::draw_fine(const View& view, int row) noexcept {
  const int count = view.right - view.left;
  if (count <= 0) return;
  std::fill_n(scratch_.sum.begin(), count, Texel{});
  const float* x = rays_.x(row) + view.left;
  const float* y = rays_.y(row) + view.left;
  const auto row_step = rays_.x(1) - rays_.x(0);
  const int passes = view.instant_count / (kInstantsPerPass * kRowPhases);
  const int quarter = view.instant_count / 4;
  for (int sample = 0; sample < 4; ++sample) {
    const float dx = 0.5F * kOffsets[sample].x;
    const float dy = 0.5F * kOffsets[sample].y;
    // Even and odd columns are gathered apart, so that each run of samples shares one instant.
    for (int parity = 0; parity < 2; ++parity) {
      const int run = (count - parity + 1) / 2;
      for (int i = 0; i < run; ++i) {
        const float* px = x + parity + 2 * i;
        const float* py = y + parity + 2 * i;
        scratch_.x[static_cast<std::size_t>(i)] =
            px[0] + dx * (px[1] - px[-1]) + dy * (px[row_step] - px[-row_step]);
        scratch_.y[static_cast<std::size_t>(i)] =
            py[0] + dx * (py[1] - py[-1]) + dy * (py[row_step] - py[-row_step]);
      }
      const int turn = kOrders[(row + 2 * ((view.left + parity) & 1)) & 3][sample];
      for (int pass = 0; pass < passes; ++pass) {
        // One instant in each quarter of the exposure, in pairs as far before its middle as after:
        // whatever the row, the mean is mid-exposure.
        const int step = pass * kRowPhases + ((row / 4) & (kRowPhases - 1));
        const int instants[4] = {quarter - 1 - step, 2 * quarter - 1 - step, 2 * quarter + step,
                                 3 * quarter + step};
        add_samples(*view.texture, view.instants[static_cast<std::size_t>(instants[turn])], run,
                    parity, 2);
      }
    }
  }
  composite(view, row, 1.0F / static_cast<float>(4 * passes));
}

void Renderer::draw_even(const View& view, int row) noexcept {
  const int count = view.right - view.left;
  if (count <= 0) return;
  std::fill_n(scratch_.sum.begin(), count, Texel{});
  const float* x = rays_.x(row) + view.left;
  const float* y = rays_.y(row) + view.left;
  const auto row_step = rays_.x(1) - rays_.x(0);
  const auto place = [](int step) {
    return (static_cast<float>(step) + 0.5F) / static_cast<float>(kEvenSamples) - 0.5F;
  };
  for (int sample = 0; sample < kEvenSamples * kEvenSamples; ++sample) {
    const float dx = 0.5F * place(sample % kEvenSamples);
    const float dy = 0.5F * place(sample / kEvenSamples);
    for (int i = 0; i < count; ++i) {
      const auto to = static_cast<std::size_t>(i);
      scratch_.x[to] = x[i] + dx * (x[i + 1] - x[i - 1]) + dy * (x[i + row_step] - x[i - row_step]);
      scratch_.y[to] = y[i] + dx * (y[i + 1] - y[i - 1]) + dy * (y[i + row_step] - y[i - row_step]);
    }
    for (int i = 0; i < view.instant_count; ++i) {
      add_samples(*view.texture, view.instants[static_cast<std::size_t>(i)], count, 0, 1);
    }
  }
  composite(view, row, 1.0F / static_cast<float>(kEvenSamples * kEvenSamples * view.instant_count));
}

void Renderer::composite(const View& view, int row, float weight) noexcept {
  float* out = scene_.data() +
               static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px) +
               view.left;
  const Texel* sum = scratch_.sum.data();
  const float lit = weight * view.shade;
  for (int i = 0; i < view.right - view.left; ++i) {
    out[i] = out[i] * (1.0F - weight * sum[i].coverage) + lit * sum[i].reflectance;
  }
}

void Renderer::blur_rows() noexcept {
  const auto width = static_cast<std::size_t>(camera_.width_px);
  float* middle = padded_.data() + kMaxRadius;
  for (int row = 0; row < camera_.height_px; ++row) {
    const auto index = static_cast<std::size_t>(row);
    const float* source = scene_.data() + index * width;
    std::copy_n(source, width, middle);
    std::fill_n(padded_.data(), kMaxRadius, source[0]);
    std::fill_n(middle + width, kMaxRadius, source[width - 1]);
    const float* weights = kernels_.data() + index * (kMaxRadius + 1);
    float* out = blurred_.data() + index * width;
    for (std::size_t i = 0; i < width; ++i) out[i] = weights[0] * middle[i];
    for (int k = 1; k <= radii_[index]; ++k) {
      const float weight = weights[k];
      const float* before = middle - k;
      const float* after = middle + k;
      for (std::size_t i = 0; i < width; ++i) out[i] += weight * (before[i] + after[i]);
    }
  }
}

void Renderer::expose_row(int row, double time, Random& random, std::uint8_t* pixels) noexcept {
  const auto width = static_cast<std::size_t>(camera_.width_px);
  const auto index = static_cast<std::size_t>(row);
  const auto blurred_row = [&](int r) {
    return blurred_.data() +
           static_cast<std::size_t>(std::clamp(r, 0, camera_.height_px - 1)) * width;
  };
  const float* weights = kernels_.data() + index * (kMaxRadius + 1);
  float* light = row_.data();
  const float* centre = blurred_row(row);
  for (std::size_t i = 0; i < width; ++i) light[i] = weights[0] * centre[i];
  for (int k = 1; k <= radii_[index]; ++k) {
    const float weight = weights[k];
    const float* above = blurred_row(row - k);
    const float* below = blurred_row(row + k);
    for (std::size_t i = 0; i < width; ++i) light[i] += weight * (above[i] + below[i]);
  }

  light_row(row, time, light);
  const float* normals = normals_.data() + random.next() % kNormals;
  const double read_counts = noise_.read_counts * sensor_gain_;
  const auto read_variance = static_cast<float>(read_counts * read_counts);
  const auto shot = static_cast<float>(noise_.shot_counts_per_count * sensor_gain_);
  for (std::size_t i = 0; i < width; ++i) {
    const float level = light[i];
    const float noisy = level + std::sqrt(read_variance + shot * level) * normals[i];
    light[i] = std::min(std::max(noisy + 0.5F, 0.0F), 255.0F);
  }
  std::uint8_t* out = pixels + index * width;
  if (camera_.mirrored) {
    for (std::size_t i = 0; i < width; ++i)
      out[width - 1 - i] = static_cast<std::uint8_t>(light[i]);
  } else {
    for (std::size_t i = 0; i < width; ++i) out[i] = static_cast<std::uint8_t>(light[i]);
  }
}

}  // namespace tagwrench::sim
