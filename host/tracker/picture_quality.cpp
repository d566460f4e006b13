#include "host/tracker/picture_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace tagwrench {
namespace {

constexpr int kWhite = 250;  ///< grey levels: beyond, the sensor is at its end
/// Pixels at half the resolution: how far apart an edge is looked at finely and coarsely.
constexpr int kFine = 1;
constexpr int kCoarse = 8;
/// What makes an edge: grey levels over the coarse distance, and part of the picture's contrast.
constexpr int kMinEdge = 16;
constexpr double kMinEdgeFraction = 0.3;
constexpr std::size_t kMinEdges = 50;
constexpr double kSharpestFraction = 0.3;
constexpr double kMaxBlur_px = 12;

/// 2 x 2 pixels added up.
struct Halved {
  int width = 0, height = 0;
  std::vector<int> level;

  explicit Halved(const ImageView& image) : width(image.width / 2), height(image.height / 2) {
    level.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
      const std::uint8_t* above = image.pixels + static_cast<std::ptrdiff_t>(2 * y) * image.stride;
      const std::uint8_t* below = above + image.stride;
      for (int x = 0; x < width; ++x)
        level.push_back(above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1]);
    }
  }
};

/// Of every edge along one line of `count` pixels: the largest fine difference near it over the
/// contrast there.
void add_edges(const int* line, int count, std::ptrdiff_t stride, int least,
               std::vector<float>& ratios) {
  for (int i = kCoarse; i + kCoarse < count; ++i) {
    if (std::abs(line[(i + kCoarse) * stride] - line[(i - kCoarse) * stride]) < least) continue;
    int darkest = line[i * stride], brightest = darkest, fine = 0;
    for (int k = i - kCoarse; k <= i + kCoarse; ++k) {
      darkest = std::min(darkest, line[k * stride]);
      brightest = std::max(brightest, line[k * stride]);
    }
    for (int k = i - kCoarse + kFine; k <= i + kCoarse - kFine; ++k)
      fine = std::max(fine, std::abs(line[(k + kFine) * stride] - line[(k - kFine) * stride]));
    ratios.push_back(static_cast<float>(fine) / static_cast<float>(brightest - darkest));
  }
}

/// The blur that leaves this part of a step over the fine distance.
double blur_from(double ratio) {
  double sharp = 0.1, soft = kMaxBlur_px;
  for (int i = 0; i < 20; ++i) {
    const double sigma = 0.5 * (sharp + soft);
    const double fine = std::erf(2 * kFine / (sigma * std::sqrt(2.0)));
    const double coarse = std::erf(2 * kCoarse / (sigma * std::sqrt(2.0)));
    (fine / coarse > ratio ? sharp : soft) = sigma;
  }
  return soft;
}

std::optional<double> blur_px(const ImageView& image, double contrast) {
  const Halved half(image);
  const int least = std::max(4 * kMinEdge, static_cast<int>(4 * kMinEdgeFraction * contrast));
  std::vector<float> ratios;
  for (int y = 0; y < half.height; ++y)
    add_edges(half.level.data() + static_cast<std::ptrdiff_t>(y) * half.width, half.width, 1, least,
              ratios);
  for (int x = 0; x < half.width; ++x)
    add_edges(half.level.data() + x, half.height, half.width, least, ratios);
  if (ratios.size() < kMinEdges) return std::nullopt;
  const auto at = ratios.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(ratios.size()) *
                                                               (1 - kSharpestFraction));
  std::nth_element(ratios.begin(), at, ratios.end());
  return blur_from(*at);
}

}  // namespace

PictureQuality picture_quality(const ImageView& image) {
  std::array<int, 256> histogram{};
  int pixels = 0;
  for (int y = 0; y < image.height; y += 2) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    for (int x = 0; x < image.width; x += 2) {
      ++histogram[row[x]];
      ++pixels;
    }
  }
  PictureQuality quality;
  int below = 0;
  for (int level = 0; level < 256; ++level) {
    below += histogram[static_cast<std::size_t>(level)];
    if (below * 100 <= pixels) quality.dark_counts = level + 1;
    if (below * 100 < pixels * 99) quality.bright_counts = level + 1;
    if (level == kWhite - 1) quality.white_fraction = 1 - static_cast<double>(below) / pixels;
  }
  quality.blur_px = blur_px(image, quality.bright_counts - quality.dark_counts);
  return quality;
}

}  // namespace tagwrench
