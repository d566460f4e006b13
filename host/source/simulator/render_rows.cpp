// The renderer's inner loops: texel lookups, compositing, point spread, noise. One row at a time,
// written so that the compiler turns the arithmetic into vector code.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

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

/// A ray's coordinate 2 dx and 2 dy pixels beside its pixel's middle, by those of the neighbours.
float beside(const float* ray, std::ptrdiff_t row_step, float dx, float dy) {
  return ray[0] + dx * (ray[1] - ray[-1]) + dy * (ray[row_step] - ray[-row_step]);
}

constexpr int kVisibilityGrid = 16;  // points along each side of a tag
constexpr double kMinContrast_counts = 10;
constexpr double kSpotReach = 5;  // sigmas, where a spot of light ends

// wave[i] = amplitude sin(k i + phase), by turning a phasor; k in rad per px.
void fill_wave(double amplitude, double k, double phase, int count, float* wave) {
  const auto turn_cos = static_cast<float>(std::cos(k));
  const auto turn_sin = static_cast<float>(std::sin(k));
  auto c = static_cast<float>(amplitude * std::cos(phase));
  auto s = static_cast<float>(amplitude * std::sin(phase));
  for (int i = 0; i < count; ++i) {
    wave[i] = s;
    const float next = s * turn_cos + c * turn_sin;
    c = c * turn_cos - s * turn_sin;
    s = next;
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
  std::copy_n(rays_.x(row) + view.left, count, scratch_.x.begin());
  std::copy_n(rays_.y(row) + view.left, count, scratch_.y.begin());
  std::fill_n(scratch_.sum.begin(), count, Texel{});
  add_samples(*view.texture, view.instants[0], count, 0, 1);
  composite(view, row, 1.0F);
}

void Renderer::draw_fine(const View& view, int row) noexcept {
  const int count = view.right - view.left;
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
        const auto to = static_cast<std::size_t>(i);
        scratch_.x[to] = beside(x + parity + 2 * i, row_step, dx, dy);
        scratch_.y[to] = beside(y + parity + 2 * i, row_step, dx, dy);
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
      scratch_.x[to] = beside(x + i, row_step, dx, dy);
      scratch_.y[to] = beside(y + i, row_step, dx, dy);
    }
    for (int i = 0; i < view.instant_count; ++i)
      add_samples(*view.texture, view.instants[static_cast<std::size_t>(i)], count, 0, 1);
  }
  composite(view, row, 1.0F / static_cast<float>(kEvenSamples * kEvenSamples * view.instant_count));
}

void Renderer::composite(const View& view, int row, float weight) noexcept {
  float* out = scene_.data() +
               static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px) +
               view.left;
  const Texel* sum = scratch_.sum.data();
  const float lit = weight * view.shade;
  for (int i = 0; i < view.right - view.left; ++i)
    out[i] = out[i] * (1.0F - weight * sum[i].coverage) + lit * sum[i].reflectance;
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
  if (camera_.mirrored)
    for (std::size_t i = 0; i < width; ++i)
      out[width - 1 - i] = static_cast<std::uint8_t>(light[i]);
  else
    for (std::size_t i = 0; i < width; ++i) out[i] = static_cast<std::uint8_t>(light[i]);
}

// The same shape as covered().
void Renderer::draw_occluder_row(const Going<Occluder>& occluder, int row, double time) noexcept {
  if (time < occluder.begin || time >= occluder.end()) return;
  const Occluder& o = occluder.what;
  const int width = camera_.width_px;
  const Eigen::Vector2d left = from_centre(0, row) - place(occluder, time);
  const double half_edge = half_edge_px(o, exposure_.time);
  const double reach = 0.5 * o.width_px + half_edge;
  float* cover = scratch_.coverage.data();
  const auto x0 = static_cast<float>(left.x());
  const auto scale = static_cast<float>(0.5 / half_edge);
  const auto inner = static_cast<float>(0.5 + 0.25 * o.width_px / half_edge);
  if (o.shape == OccluderShape::disc) {
    if (std::abs(left.y()) > reach) return;
    const auto y2 = static_cast<float>(left.y() * left.y());
    for (int i = 0; i < width; ++i) {
      const float x = x0 + static_cast<float>(i);
      cover[i] = std::min(std::max(inner - scale * std::sqrt(x * x + y2), 0.0F), 1.0F);
    }
  } else {
    const double along_x = std::cos(o.direction);
    const double first = left.x() * along_x + left.y() * std::sin(o.direction);
    const double last = first + along_x * (width - 1);
    if (std::min(first, last) > reach || std::max(first, last) < -reach) return;
    const auto a = static_cast<float>(first);
    const auto b = static_cast<float>(along_x);
    for (int i = 0; i < width; ++i) {
      const float distance = std::abs(a + b * static_cast<float>(i));
      cover[i] = std::min(std::max(inner - scale * distance, 0.0F), 1.0F);
    }
  }
  // A chequer of waves that moves with the object.
  const double k = 2 * std::numbers::pi / o.texture_wavelength_px;
  float* wave = scratch_.reflectance.data();
  fill_wave(o.texture * std::cos(k * left.y()), k, k * left.x(), width, wave);
  const auto reflectance = static_cast<float>(o.reflectance);
  float* out = scene_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  for (int i = 0; i < width; ++i) {
    const float own = std::max(reflectance + wave[i], 0.0F);
    out[i] += cover[i] * (own - out[i]);
  }
}

// Reflectance as lit by even light -> grey levels, in place.
void Renderer::light_row(int row, double time, float* light) noexcept {
  const int width = camera_.width_px;
  const std::size_t start = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  const float* gain = gain_.data() + start;
  const float* glare = glare_.data() + start;
  const double half_diagonal = 0.5 * std::hypot(camera_.width_px, camera_.height_px);
  const Eigen::Vector2d gradient = light_gradient(happening_, time) / half_diagonal;
  const Eigen::Vector2d left = from_centre(0, row);
  const double factor =
      light_factor(happening_, time, exposure_.time) * brightness_[static_cast<std::size_t>(row)];
  const auto at_left = static_cast<float>(factor * (1 + gradient.dot(left)));
  const auto slope = static_cast<float>(factor * gradient.x());
  for (int i = 0; i < width; ++i) {
    const float level = light[i] * gain[i] + glare[i];
    light[i] = level * std::max(at_left + slope * static_cast<float>(i), 0.0F);
  }
  for (const Going<Glare>& going : happening_.glare) {
    const Spot s = spot(going, time);
    const double per_px2 = 0.5 / (going.what.sigma_px * going.what.sigma_px);
    const Eigen::Vector2d off = left - s.place_px;
    const double reach = kSpotReach * going.what.sigma_px;
    if (std::abs(off.y()) > reach) continue;
    const int first = std::max(0, static_cast<int>(std::ceil(-off.x() - reach)));
    const int last = std::min(width - 1, static_cast<int>(std::floor(-off.x() + reach)));
    // Neighbours on a Gaussian have a ratio, and ratios a constant one.
    const double x = off.x() + first;
    double value = s.counts * std::exp(-per_px2 * (x * x + off.y() * off.y()));
    double ratio = std::exp(-per_px2 * (2 * x + 1));
    const double ratio_of_ratios = std::exp(-2 * per_px2);
    for (int i = first; i <= last; ++i) {
      light[i] += static_cast<float>(value);
      value *= ratio;
      ratio *= ratio_of_ratios;
    }
  }
}

// Grey levels between ideal paper and ideal ink at a pixel, after everything but blur and noise.
double Renderer::contrast_at(const Eigen::Vector2d& pixel, double middle_time) const noexcept {
  const int column = static_cast<int>(std::lround(pixel.x()));
  const int row = static_cast<int>(std::lround(pixel.y()));
  if (column < 0 || row < 0 || column >= camera_.width_px || row >= camera_.height_px) return 0;
  const double time = row_time(row, middle_time);
  const Eigen::Vector2d off = from_centre(pixel.x(), pixel.y());
  double seen = 1;
  for (const auto& occluder : happening_.occluders)
    seen *= 1 - covered(occluder, off, time, exposure_.time);
  double spots = 0;
  for (const auto& going : happening_.glare) {
    const Spot s = spot(going, time);
    spots += s.counts * std::exp(-0.5 * (off - s.place_px).squaredNorm() /
                                 (going.what.sigma_px * going.what.sigma_px));
  }
  const double half_diagonal = 0.5 * std::hypot(camera_.width_px, camera_.height_px);
  const double factor = light_factor(happening_, time, exposure_.time) *
                        brightness_[static_cast<std::size_t>(row)] *
                        (1 + light_gradient(happening_, time).dot(off) / half_diagonal);
  const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px) +
                        static_cast<std::size_t>(column);
  const auto level = [&](double reflectance) {
    return std::min(factor * (seen * reflectance * gain_[i] + glare_[i]) + spots, 255.0);
  };
  return level(target_.paper_reflectance) - level(target_.ink_reflectance);
}

void Renderer::judge_visibility(double middle_time) noexcept {
  for (std::size_t tag = 0; tag < tags_.size(); ++tag) {
    const RigidPose pose = middle_pose_ * tags_[tag].platform_T_tag;
    int visible = 0;
    for (int v = 0; v < kVisibilityGrid; ++v) {
      for (int u = 0; u < kVisibilityGrid; ++u) {
        const Eigen::Vector3d point =
            pose *
            Eigen::Vector3d((u + 0.5) / kVisibilityGrid - 0.5, (v + 0.5) / kVisibilityGrid - 0.5, 0)
                .cwiseProduct(Eigen::Vector3d(target_.tag_size, target_.tag_size, 0));
        if (point.z() <= 0) continue;
        const Eigen::Vector2d pixel = project(camera_, point.head<2>() / point.z());
        visible += contrast_at(pixel, middle_time) >= kMinContrast_counts ? 1 : 0;
      }
    }
    visible_[tag] = visible / static_cast<double>(kVisibilityGrid * kVisibilityGrid);
  }
}

}  // namespace tagwrench::sim
