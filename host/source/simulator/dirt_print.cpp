#include "host/source/simulator/dirt_print.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::sim {
namespace {

constexpr double kEdge = 0.03e-3;          // m, softness of the outline
constexpr double kScratchWidth = 1 / 6.0;  // of Dirt::size

// A capsule from one point to another; a speck has both in one place.
struct Mark {
  double x0, y0, x1, y1, radius;

  double distance(double x, double y) const {
    const double dx = x1 - x0;
    const double dy = y1 - y0;
    const double squared = dx * dx + dy * dy;
    const double along =
        squared > 0 ? std::clamp(((x - x0) * dx + (y - y0) * dy) / squared, 0.0, 1.0) : 0.0;
    return std::hypot(x - x0 - along * dx, y - y0 - along * dy) - radius;
  }
};

void draw(Texture& t, const Mark& mark, double reflectance) {
  for (int v = 0; v < t.height; ++v) {
    for (int u = 0; u < t.width; ++u) {
      const double share = std::clamp(0.5 - mark.distance(t.x(u), t.y(v)) / kEdge, 0.0, 1.0);
      if (share <= 0) continue;
      // Texels hold reflectance times coverage; dirt lies on paper alone.
      Texel& texel = t.texels[t.index(u, v)];
      const double paper = texel.coverage;
      texel.reflectance =
          static_cast<float>(texel.reflectance + share * (reflectance * paper - texel.reflectance));
    }
  }
}

}  // namespace

Texture with_dirt(const Texture& clean, const Dirt& dirt, double tag_size, std::uint64_t seed,
                  std::uint64_t number) {
  Texture t = clean;
  Random random = Random::numbered(seed, kDirt, number);
  const double half = 0.5 * tag_size;
  const auto anywhere = [&] { return random.uniform(-half, half); };
  for (int i = 0; i < dirt.specks; ++i) {
    const double x = anywhere();
    const double y = anywhere();
    draw(t, {x, y, x, y, 0.5 * dirt.size * random.uniform(0.4, 1.0)}, dirt.reflectance);
  }
  for (int i = 0; i < dirt.scratches; ++i) {
    const double x = anywhere();
    const double y = anywhere();
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double length = random.uniform(0.2, 1.0) * half;
    draw(t,
         {x, y, x + length * std::cos(angle), y + length * std::sin(angle),
          0.5 * kScratchWidth * dirt.size},
         dirt.reflectance);
  }
  return t;
}

}  // namespace tagwrench::sim
