// Flat pictures of the things that the camera sees, in units of reflectance: a tag as it comes out
// of the printer and off the scissors, and what is around it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/source/simulator/disturbances.h"
#include "host/source/simulator/print_fault.h"
#include "host/source/simulator/random.h"
#include "host/source/simulator/scenario.h"

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
  /// Visits every texel with the place that it shows: visit(x, y, texel), m.
  void each(const auto& visit) {
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u)
        visit((u - centre_u) / texels_per_m, (v - centre_v) / texels_per_m, texels[index(u, v)]);
  }
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

// Tags.

/// The cells of a tag, black frame included, row by row as printed: true = black.
struct TagCells {
  int across = 0;
  std::vector<bool> black;
  bool is_black(int column, int row) const {
    return black[static_cast<std::size_t>(row * across + column)];
  }
};

/// Families as in sensor.yaml: aruco_original, aruco_4x4_50 ... apriltag_36h11, grid_10x10.
bool family_exists(const std::string& family);
/// Number of ids in a family.
int family_size(const std::string& family);
TagCells tag_cells(const std::string& family, int id);

/// Paper and ink; every edge at its exact place (area coverage), moved only by ink spread and
/// roughness, and by what is off as a whole.
Texture print_tag(const Target& target, const PrintFault& fault, const TagCells& cells,
                  double texels_per_m, std::uint64_t seed);

// Dust and scratches on a printed tag.

/// A copy of `clean` (a tag's paper, `tag_size` m along the black square) with dirt on it, placed
/// within the square by `seed`; each `number` elsewhere.
Texture with_dirt(const Texture& clean, const Dirt& dirt, double tag_size, std::uint64_t seed,
                  std::uint64_t number);

// What the camera sees around the tags: a printed plate with spring ends and screws, and the pads
// that carry the tags.

/// The plate, opaque, +-half_x by +-half_y.
Texture print_plate(const Mechanics& mechanics, double half_x, double half_y, double texels_per_m,
                    std::uint64_t seed);

/// One face of the roof under a tag, larger than the tag's paper by `margin`.
Texture print_pad(double half_paper, double margin, double texels_per_m, std::uint64_t seed);

}  // namespace tagwrench::sim
