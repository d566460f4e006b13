#include "host/source/simulator/platform_print.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::sim {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kPlateReflectance = 0.43;
constexpr double kPadReflectance = 0.62;
constexpr double kFilamentWidth = 0.45e-3;  // m, one extruded line
constexpr double kSpringRadius = 2.375e-3;  // m
constexpr double kCoilPitch = 0.85e-3;      // m, as it looks from the lens
constexpr double kScrewRadius = 1.15e-3;    // m
constexpr double kScrewX = 5.2e-3;          // m, one on each side of the roof
constexpr double kEdge = 0.04e-3;           // m, softness of drawn outlines

// 1 inside (negative distance), 0 outside.
double inside(double distance) { return std::clamp(0.5 - distance / kEdge, 0.0, 1.0); }

double blend(double below, double above, double share) { return below + share * (above - below); }

// A spring runs from its seat towards the lens, so perspective draws it outwards: a capsule with
// coils across.
double draw_spring(double below, double x, double y, double seat_x, double seat_y) {
  const double length = std::hypot(seat_x, seat_y);
  const double ax = seat_x / length;
  const double ay = seat_y / length;
  const double along = (x - seat_x) * ax + (y - seat_y) * ay;
  const double across = (y - seat_y) * ax - (x - seat_x) * ay;
  const double radius = kSpringRadius * (1 + 0.06 * std::max(along, 0.0) / kSpringRadius);
  const double distance = std::hypot(std::min(along, 0.0), across) - radius;
  // The lit side of each turn of the wire bends around the axis.
  const double bend = 0.35 * across * across / kSpringRadius;
  const double coil = std::sin(kTau * (along + bend) / kCoilPitch);
  const double lit = std::max(coil, 0.0) * (1 - 0.6 * std::abs(across) / radius);
  const double shade = 0.07 + 0.16 * lit * lit;
  const double rim = inside(std::abs(distance - 0.25e-3) - 0.25e-3);
  return blend(blend(below, 0.55 * below, rim), shade, inside(distance));
}

double draw_screw(double below, double x, double y, double screw_x) {
  const double radius = std::hypot(x - screw_x, y);
  const double turned = 0.06 * std::sin(kTau * radius / 0.16e-3);
  const double washer = blend(below, 0.60, inside(radius - 1.55 * kScrewRadius));
  const double groove = blend(washer, 0.16, inside(radius - 1.12 * kScrewRadius));
  return blend(groove, 0.34 + turned, inside(radius - kScrewRadius));
}

}  // namespace

Texture print_plate(const Mechanics& mechanics, double half_x, double half_y, double texels_per_m,
                    std::uint64_t seed) {
  Texture t = Texture::of_size(half_x, half_y, texels_per_m);
  Random random(seed, kPlate);
  const SmoothNoise stains(random, 1.3e-3), scratches(random, 0.12e-3), grain(random, 0.04e-3);
  const double sx = mechanics.spring_half_spacing_x;
  const double sy = mechanics.spring_half_spacing_y;
  for (int v = 0; v < t.height; ++v) {
    for (int u = 0; u < t.width; ++u) {
      const double x = t.x(u);
      const double y = t.y(v);
      const double diagonal = (x - y) / std::numbers::sqrt2 + 0.05e-3 * stains(x, y);
      const double lines = 0.035 * std::sin(kTau * diagonal / kFilamentWidth);
      const double gouge = 0.05 * std::max(scratches(0.4 * (x - y), 1.6 * (x + y)) - 1.2, 0.0);
      double shade = kPlateReflectance + lines + gouge + 0.025 * stains(y, x) + 0.012 * grain(x, y);
      shade = draw_screw(shade, x, y, -kScrewX);
      shade = draw_screw(shade, x, y, kScrewX);
      for (const double side_x : {-sx, sx}) {
        for (const double side_y : {-sy, sy}) shade = draw_spring(shade, x, y, side_x, side_y);
      }
      t.texels[t.index(u, v)] = {.reflectance = static_cast<float>(std::clamp(shade, 0.02, 1.0)),
                                 .coverage = 1};
    }
  }
  return t;
}

Texture print_pad(double half_paper, double margin, double texels_per_m, std::uint64_t seed) {
  const double half_x = half_paper + margin;
  const double half_y = half_paper + 0.35 * margin;
  Texture t = Texture::of_size(half_x, half_y, texels_per_m);
  Random random(seed, kPlate + 1);
  const SmoothNoise glue(random, 0.5e-3), grain(random, 0.06e-3);
  for (int v = 0; v < t.height; ++v) {
    for (int u = 0; u < t.width; ++u) {
      const double x = t.x(u);
      const double y = t.y(v);
      const double cover = inside(std::abs(x) - half_x) * inside(std::abs(y) - half_y);
      const double lines = 0.03 * std::sin(kTau * x / 0.21e-3);
      const double shade = kPadReflectance + lines + 0.04 * glue(x, y) + 0.01 * grain(x, y);
      t.texels[t.index(u, v)] = {
          .reflectance = static_cast<float>(cover * std::clamp(shade, 0.0, 1.0)),
          .coverage = static_cast<float>(cover)};
    }
  }
  return t;
}

}  // namespace tagwrench::sim
