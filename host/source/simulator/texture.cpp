#include "host/source/simulator/texture.h"

#include <cmath>

namespace tagwrench::sim {

Texture Texture::of_size(double half_x, double half_y, double texels_per_m, bool opaque) {
  Texture t;
  t.texels_per_m = texels_per_m;
  t.width = 2 * static_cast<int>(std::ceil(half_x * texels_per_m)) + 4;
  t.height = 2 * static_cast<int>(std::ceil(half_y * texels_per_m)) + 4;
  t.centre_u = 0.5 * (t.width - 1);
  t.centre_v = 0.5 * (t.height - 1);
  const std::size_t size = static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height);
  t.reflectance.assign(size, 0.0F);
  if (!opaque) t.coverage.assign(size, 0.0F);
  return t;
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
