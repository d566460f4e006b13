// The inner loop of photometric alignment: compares an image with the template, pixel by pixel, and
// sums up what Gauss-Newton needs. Vector code for whatever the processor offers, chosen at run
// time (Google Highway).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "host/tracker/pixel_template.h"

namespace tagwrench {

/// How one patch is seen from the pose of this step.
struct PatchView {
  std::array<float, 9> camera_R_platform{};  ///< row by row
  std::array<float, 3> camera_t_platform{};  ///< m
  /// Displacement in the template per displacement in the image, px/px, row by row.
  std::array<float, 4> template_per_image{1, 0, 0, 1};
  /// gain * (1, across, down, down^2) times the image plus offset is compared with the template.
  std::array<float, 4> gain{1, 0, 0, 0};
  float offset = 0;
  std::array<float, 2> blur{};  ///< b = blur[0] + blur[1] * depth, px^2
};

struct NormalEquations {
  /// Weighted sums of the whitened columns times the whitened residual, in the order of
  /// PatchVector.
  std::array<float, kPatchParameters> rhs{};
  float squares = 0;  ///< weighted, of whitened residuals
  float weights = 0;
  float inside = 0;  ///< pixels that lie in the image and are not saturated
};

/// The part of an 8-bit image that may be read.
struct PixelWindow {
  const std::uint8_t* pixels = nullptr;
  int stride = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< exclusive at right and bottom
};

/// Which image pixel each pixel of the template was last compared with. Once alignment is within a
/// small part of a pixel the pairs stay: a new choice would bring new noise with every step, and
/// the search would never end.
struct PixelPairs {
  explicit PixelPairs(std::size_t count = 0)
      : column(count), row(count), level(count), valid(count) {}
  PixelArray column, row;  ///< px
  PixelArray level;        ///< grey level
  PixelArray valid;        ///< 1 inside the image, else 0
};

/// residual = gain * image + offset - (template, blurred) at the image pixel that is nearest to
/// where the template's pixel is projected; the template's polynomial is evaluated where that image
/// pixel's centre falls. So neither image nor noise is interpolated. Weights are Tukey's biweight
/// of residual * weight * inverse_cut (0: all 1). `views` and `sums` have one entry for each patch,
/// `pairs` one for each pixel; they are kept as they are when `keep` is set.
void sum_patches(const PixelTemplate& pixels, const PixelWindow& image,
                 std::span<const PatchView> views, float inverse_cut, bool keep, PixelPairs& pairs,
                 std::span<NormalEquations> sums) noexcept;

}  // namespace tagwrench
