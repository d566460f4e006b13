// Flat pictures of the things that the camera sees, in units of reflectance.
#pragma once

#include <cstddef>
#include <vector>

#include "host/source/simulator/random.h"

namespace tagwrench::sim {

/// `reflectance` is multiplied by `coverage`; of an opaque picture the coverage counts for nothing.
/// Side by side, for whoever looks up one needs the other.
struct Texel {
  float reflectance = 0;
  float coverage = 0;
};

/// A picture on a plane. The plane point (x, y), in metres, lies at texel (x, y) * texels_per_m +
/// (centre_u, centre_v), texel centres at integers.
struct Texture {
  int width = 0;
  int height = 0;
  double texels_per_m = 0;
  double centre_u = 0;
  double centre_v = 0;
  std::vector<Texel> texels;

  /// A picture of +-half_x by +-half_y metres; fill it texel by texel.
  static Texture of_size(double half_x, double half_y, double texels_per_m);

  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(u);
  }
  double x(int u) const { return (u - centre_u) / texels_per_m; }
  double y(int v) const { return (v - centre_v) / texels_per_m; }
};

/// The texture after a Gaussian of this width (in texels), enlarged so that nothing is cut off.
Texture softened(const Texture& t, double sigma_texels);

/// Smooth random field with zero mean, unit variance and a correlation length of about `spacing`
/// metres.
class SmoothNoise {
 public:
  SmoothNoise(Random& random, double spacing);
  double operator()(double x, double y) const;

 private:
  static constexpr int kCells = 128;  ///< the field repeats after so many
  double spacing_;
  std::vector<float> values_;
};

}  // namespace tagwrench::sim
