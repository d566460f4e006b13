#include "host/source/simulator/texture.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::sim {
namespace {

std::vector<float> gaussian(double sigma) {
  std::vector<float> weights(static_cast<std::size_t>(std::ceil(3 * sigma)) + 1);
  float sum = 0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    weights[k] = static_cast<float>(std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma)));
    sum += k == 0 ? weights[k] : 2 * weights[k];
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

/// The columns of `from` (rows of `width`) convolved, turned into the rows of what is returned.
std::vector<float> blurred_columns(const std::vector<float>& from, int width,
                                   const std::vector<float>& weights) {
  const int height = static_cast<int>(from.size()) / width;
  const int reach = static_cast<int>(weights.size()) - 1;
  std::vector<float> out(from.size(), 0.0F);
  for (int v = 0; v < height; ++v) {
    for (int k = std::max(-reach, -v); k <= std::min(reach, height - 1 - v); ++k) {
      const float weight = weights[static_cast<std::size_t>(std::abs(k))];
      const float* row = from.data() + static_cast<std::ptrdiff_t>(v + k) * width;
      for (int u = 0; u < width; ++u)
        out[static_cast<std::size_t>(u) * static_cast<std::size_t>(height) +
            static_cast<std::size_t>(v)] += weight * row[u];
    }
  }
  return out;
}

}  // namespace

Texture Texture::of_size(double half_x, double half_y, double texels_per_m) {
  Texture t;
  t.texels_per_m = texels_per_m;
  t.width = 2 * static_cast<int>(std::ceil(half_x * texels_per_m)) + 4;
  t.height = 2 * static_cast<int>(std::ceil(half_y * texels_per_m)) + 4;
  t.centre_u = 0.5 * (t.width - 1);
  t.centre_v = 0.5 * (t.height - 1);
  t.texels.resize(static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height));
  return t;
}

Texture softened(const Texture& t, double sigma_texels) {
  if (sigma_texels <= 0) return t;
  const std::vector<float> weights = gaussian(sigma_texels);
  const int more = static_cast<int>(weights.size()) - 1;
  Texture out = t;
  out.width += 2 * more;
  out.height += 2 * more;
  out.centre_u += more;
  out.centre_v += more;
  out.texels.assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), {});
  for (float Texel::*part : {&Texel::reflectance, &Texel::coverage}) {
    std::vector<float> wide(out.texels.size());
    for (int v = 0; v < t.height; ++v) {
      for (int u = 0; u < t.width; ++u)
        wide[out.index(u + more, v + more)] = t.texels[t.index(u, v)].*part;
    }
    const std::vector<float> soft =
        blurred_columns(blurred_columns(wide, out.width, weights), out.height, weights);
    for (std::size_t i = 0; i < soft.size(); ++i) out.texels[i].*part = soft[i];
  }
  return out;
}

SmoothNoise::SmoothNoise(Random& random, double spacing)
    : spacing_(spacing), values_(static_cast<std::size_t>(kCells * kCells)) {
  double mean = 0;
  for (float& value : values_) {
    value = static_cast<float>(random.normal());
    mean += value;
  }
  mean /= static_cast<double>(values_.size());
  for (float& value : values_) value -= static_cast<float>(mean);
}

double SmoothNoise::operator()(double x, double y) const {
  const double u = x / spacing_;
  const double v = y / spacing_;
  const double fu = u - std::floor(u);
  const double fv = v - std::floor(v);
  const auto value = [&](int du, int dv) {
    const auto wrap = [](double a) {
      return static_cast<std::size_t>(static_cast<long long>(std::floor(a)) & (kCells - 1));
    };
    return static_cast<double>(values_[wrap(v + dv) * kCells + wrap(u + du)]);
  };
  const double top = (1 - fu) * value(0, 0) + fu * value(1, 0);
  const double bottom = (1 - fu) * value(0, 1) + fu * value(1, 1);
  // Linear interpolation leaves (2/3)^2 of the variance on average.
  return 1.5 * ((1 - fv) * top + fv * bottom);
}

}  // namespace tagwrench::sim
