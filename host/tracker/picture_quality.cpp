#include "host/tracker/picture_quality.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "host/core/algebra/levenberg_marquardt.h"

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
constexpr double kMaxPictureBlur_px = 12;

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
  double sharp = 0.1, soft = kMaxPictureBlur_px;
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

// Of the sharpening that a camera does to its pictures (an unsharp mask), with what is known of it
// beforehand: standard deviations of a factor e^0.5 and of 2, beside residuals of 3 grey levels.
constexpr double kUsualRadius_px = 1;
constexpr double kRadiusWeight = 9 / (0.5 * 0.5);
constexpr double kAmountWeight = 9 / (2.0 * 2.0);
constexpr double kMaxAmount = 4;
constexpr double kBlack = 4;  // grey levels: below, the picture is at its end

constexpr double kMaxPixels = 2500;  // of a tag; a grid of them where there are more
constexpr double kMaxBlur_px = 30;
constexpr double kMinContrast = 8;     // grey levels
constexpr double kMaxResidual = 0.12;  // of the contrast
constexpr double kMaxShift = 1;        // of a corner, cells
constexpr double kMargin = 0.3;        // of white around the square that is looked at, cells
constexpr double kClear = 2;           // blurs between that and the paper's end

/// Corners (8), logarithms of the blur and of the sharpening's radius, its amount, gain, its slopes
/// to the right and down, offset.
constexpr int kBlur = 8, kRadius = 9, kAmount = 10, kGain = 11, kOffset = 14, kUnknowns = 15;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

Unknowns with_corners(const Square& corners) {
  Unknowns x = Unknowns::Zero();
  for (int i = 0; i < 4; ++i) x.segment<2>(2 * i) = corners[static_cast<std::size_t>(i)];
  return x;
}

/// Pixels -> cells, 0..cells to the right and down.
Eigen::Matrix3d cells_from_pixels(const Unknowns& x, int cells) {
  const double n = cells;
  const std::array<std::pair<double, double>, 4> at = {{{0, 0}, {n, 0}, {n, n}, {0, n}}};
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const double px = x[2 * i], py = x[2 * i + 1];
    const auto [u, v] = at[static_cast<std::size_t>(i)];
    a.row(2 * i) << px, py, 1, 0, 0, 0, -u * px, -u * py;
    a.row(2 * i + 1) << 0, 0, 0, px, py, 1, -v * px, -v * py;
    b[2 * i] = u;
    b[2 * i + 1] = v;
  }
  const Eigen::Matrix<double, 8, 1> h = a.fullPivLu().solve(b);
  Eigen::Matrix3d out;
  out << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return out;
}

/// Along one axis of the tag: how much of each cell a pixel sees through a blur, and how that
/// changes with its place (1/cells) and with the logarithm of the blur.
struct Seen {
  std::vector<double> part, by_place, by_blur;

  /// `at` and `blur` in cells, `pixel` too: its width.
  void look(double at, double blur, double pixel, int cells) {
    part.resize(static_cast<std::size_t>(cells));
    by_place.resize(part.size());
    by_blur.resize(part.size());
    Beyond before;
    for (int line = 0; line <= cells; ++line) {
      const Beyond here = beyond(at - line, blur, pixel);
      if (line > 0) {
        const auto cell = static_cast<std::size_t>(line - 1);
        part[cell] = before.share - here.share;
        by_place[cell] = (before.density - here.density) / blur;
        by_blur[cell] = here.moment - before.moment;
      }
      before = here;
    }
  }

 private:
  struct Beyond {
    double share = 0, density = 0, moment = 0;
  };
  /// How much is seen of what lies before a line, from `off` behind it: a Gaussian, averaged over
  /// the pixel's width (Gauss-Legendre, three places).
  static Beyond beyond(double off, double blur, double pixel) {
    constexpr double kFar = 6;  // blurs
    if (std::abs(off) > kFar * blur + 0.5 * pixel) return {off > 0 ? 1.0 : 0.0, 0, 0};
    constexpr std::array<std::pair<double, double>, 3> kPlaces = {
        {{-0.387298334620742, 5.0 / 18}, {0, 8.0 / 18}, {0.387298334620742, 5.0 / 18}}};
    Beyond out;
    for (const auto& [place, weight] : kPlaces) {
      const double s = (off + place * pixel) / blur;
      const double density = weight * std::exp(-0.5 * s * s) / std::sqrt(2 * std::numbers::pi);
      out.share += weight * 0.5 * std::erfc(-s / std::numbers::sqrt2);
      out.density += density;
      out.moment += s * density;
    }
    return out;
  }
};

class TagFit {
 public:
  TagFit(const ImageView& image, const TagPattern& pattern) : image_(image), pattern_(pattern) {}

  /// Chooses the pixels that are looked at: inside the image, on the square and `margin` cells
  /// around it.
  void choose(const Unknowns& x, double margin) {
    const Eigen::Matrix3d to_cells = cells_from_pixels(x, pattern_.cells);
    const Eigen::Matrix3d from_cells = to_cells.inverse();
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    const double n = pattern_.cells;
    for (const double u : {-margin, n + margin}) {
      for (const double v : {-margin, n + margin}) {
        const Eigen::Vector2d p = (from_cells * Eigen::Vector3d(u, v, 1)).hnormalized();
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    }
    low = low.cwiseMax(0);
    high = high.cwiseMin(Eigen::Vector2d(image_.width - 1, image_.height - 1));
    pixels_.clear();
    white_ = 0;
    if (!(low.array() < high.array()).all()) return;
    const double area = (high - low).prod();
    const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(area / kMaxPixels))));
    for (int row = static_cast<int>(low.y()); row <= high.y(); row += step) {
      for (int column = static_cast<int>(low.x()); column <= high.x(); column += step) {
        const Eigen::Vector2d at = (to_cells * Eigen::Vector3d(column, row, 1)).hnormalized();
        if (at.minCoeff() < -margin || at.maxCoeff() > n + margin) continue;
        const int level = image_.pixels[static_cast<std::ptrdiff_t>(row) * image_.stride + column];
        if (level >= kWhite) ++white_;
        pixels_.emplace_back(column, row, level);
      }
    }
  }

  double pixels() const { return static_cast<double>(pixels_.size()); }
  double white_fraction() const { return white_ == 0 ? 0 : white_ / pixels(); }

  FitSums<kUnknowns> sums(const Unknowns& x) {
    const Eigen::Matrix3d to_cells = cells_from_pixels(x, pattern_.cells);
    FitSums<kUnknowns> out;
    for (const Eigen::Vector3d& pixel : pixels_) add(x, to_cells, pixel, out);
    out.add(Unknowns::Unit(kRadius), std::log(kUsualRadius_px) - x[kRadius], kRadiusWeight);
    out.add(Unknowns::Unit(kAmount), -x[kAmount], kAmountWeight);
    return out;
  }

 private:
  /// What the blurred tag shows, 0 ink to 1 paper, and its derivatives by place and blur.
  struct Shown {
    double level = 1, by_u = 0, by_v = 0, by_blur = 0;
  };
  Shown shown(const Eigen::Vector2d& at, double blur_px, const Eigen::Vector2d& per_px) {
    across_.look(at.x(), blur_px * per_px.x(), per_px.x(), pattern_.cells);
    down_.look(at.y(), blur_px * per_px.y(), per_px.y(), pattern_.cells);
    Shown out;
    for (int row = 0; row < pattern_.cells; ++row) {
      const auto j = static_cast<std::size_t>(row);
      double ink = 0, ink_u = 0, ink_blur = 0;
      for (int column = 0; column < pattern_.cells; ++column) {
        if (pattern_.is_white(row, column)) continue;
        const auto i = static_cast<std::size_t>(column);
        ink += across_.part[i];
        ink_u += across_.by_place[i];
        ink_blur += across_.by_blur[i];
      }
      out.level -= down_.part[j] * ink;
      out.by_u -= down_.part[j] * ink_u;
      out.by_v -= down_.by_place[j] * ink;
      out.by_blur -= down_.part[j] * ink_blur + down_.by_blur[j] * ink;
    }
    return out;
  }

  void add(const Unknowns& x, const Eigen::Matrix3d& to_cells, const Eigen::Vector3d& pixel,
           FitSums<kUnknowns>& out) {
    const Eigen::Vector3d h = to_cells * Eigen::Vector3d(pixel.x(), pixel.y(), 1);
    const Eigen::Vector2d at = h.hnormalized();
    const Eigen::Matrix2d by_pixel =
        (to_cells.topLeftCorner<2, 2>() - at * to_cells.bottomLeftCorner<1, 2>()) / h.z();
    const double blur = std::exp(x[kBlur]), radius = std::exp(x[kRadius]);
    const double softer = std::hypot(blur, radius);
    // An edge's blur is that across it, whatever the angle between the tag's axes in the image.
    const Eigen::Vector2d per_px = by_pixel.rowwise().norm();
    const Shown lens = shown(at, blur, per_px), mask = shown(at, softer, per_px);
    const double amount = x[kAmount];
    const Shown tag{
        lens.level + amount * (lens.level - mask.level),
        lens.by_u + amount * (lens.by_u - mask.by_u), lens.by_v + amount * (lens.by_v - mask.by_v),
        lens.by_blur + amount * (lens.by_blur - mask.by_blur * std::pow(blur / softer, 2))};
    const double right = at.x() / pattern_.cells, below = at.y() / pattern_.cells;
    const double gain = x[kGain] + x[kGain + 1] * (right - 0.5) + x[kGain + 2] * (below - 0.5);
    const Eigen::RowVector2d by_place =
        gain * Eigen::RowVector2d(tag.by_u, tag.by_v) * by_pixel;  // grey levels per px
    Unknowns row;
    const std::array<double, 4> weight = {(1 - right) * (1 - below), right * (1 - below),
                                          right * below, (1 - right) * below};
    for (int k = 0; k < 4; ++k) {
      row[2 * k] = -weight[static_cast<std::size_t>(k)] * by_place.x();
      row[2 * k + 1] = -weight[static_cast<std::size_t>(k)] * by_place.y();
    }
    row[kBlur] = gain * tag.by_blur;
    row[kRadius] = -gain * amount * mask.by_blur * std::pow(radius / softer, 2);
    row[kAmount] = gain * (lens.level - mask.level);
    row.segment<3>(kGain) << tag.level, tag.level * (right - 0.5), tag.level * (below - 0.5);
    row[kOffset] = 1;
    const double model = gain * tag.level + x[kOffset];
    const bool cut_off =
        (pixel.z() >= kWhite && model >= kWhite) || (pixel.z() <= kBlack && model <= kBlack);
    if (!cut_off) out.add(row, pixel.z() - model);
  }

  const ImageView& image_;
  const TagPattern& pattern_;
  std::vector<Eigen::Vector3d> pixels_;  ///< column, row, level
  double white_ = 0;
  Seen across_, down_;
};

/// The best of some blurs, with the light that goes with it.
Unknowns start(TagFit& fit, const Square& corners) {
  Unknowns best = Unknowns::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (const double blur : {1.0, 2.0, 4.0, 8.0}) {
    Unknowns x = with_corners(corners);
    x[kBlur] = std::log(blur);
    x[kRadius] = std::log(kUsualRadius_px);
    x += fit.sums(x).step(0, kUnknowns - kGain);
    const double squares = fit.sums(x).squares;
    if (!(squares < least)) continue;
    least = squares;
    best = x;
  }
  return best;
}

/// The squares that are left.
double converge(TagFit& fit, Unknowns& x) {
  const auto moved = [](const Unknowns& from, const Unknowns& step) {
    Unknowns to = from + step;
    to[kAmount] = std::clamp(to[kAmount], 0.0, kMaxAmount);
    to[kBlur] = std::clamp(to[kBlur], std::log(kLeastBlur_px), std::log(kMaxBlur_px));
    return to;
  };
  const auto look = [&](const Unknowns& at) { return fit.sums(at); };
  return levenberg_marquardt(x, look, moved).squares;
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

std::optional<EdgeWidth> edge_width(const ImageView& image, const TagPattern& pattern,
                                    const Square& corners_px) {
  const double cell = shortest_side(corners_px) / pattern.cells;
  const double border = pattern.border / pattern.size * pattern.cells;  // cells
  if (!(cell > 1)) return std::nullopt;
  TagFit fit(image, pattern);
  const auto margin = [&](double blur) {
    return std::clamp(border - kClear * blur / cell, -0.5, kMargin);
  };
  fit.choose(with_corners(corners_px), margin(1));
  Unknowns x = start(fit, corners_px);
  converge(fit, x);
  if (!x.allFinite()) return std::nullopt;
  // What lies beyond the paper is not white: kept away from, once the blur is known.
  fit.choose(x, margin(std::exp(x[kBlur])));
  const double squares = converge(fit, x);
  if (!x.allFinite() || fit.pixels() < 10 * kUnknowns) return std::nullopt;
  EdgeWidth out;
  out.blur_px = std::exp(x[kBlur]);
  out.sharpening = x[kAmount];
  out.contrast = x[kGain];
  out.white_fraction = fit.white_fraction();
  out.residual_fraction = std::sqrt(squares / fit.pixels()) / std::abs(out.contrast);
  double shift = 0;
  for (int i = 0; i < 4; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.corners_px[k] = x.segment<2>(2 * i);
    shift = std::max(shift, (out.corners_px[k] - corners_px[k]).norm());
  }
  const bool alike = out.contrast > kMinContrast && out.residual_fraction < kMaxResidual &&
                     shift < kMaxShift * cell && out.blur_px < 0.9 * kMaxBlur_px;
  return alike ? std::optional(out) : std::nullopt;
}

}  // namespace tagwrench
