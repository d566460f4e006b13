#include "host/source/simulator/prints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/aruco/dictionary.hpp>
#include <string_view>
#include <utility>

#include "host/core/grid_tags.h"

namespace tagwrench::sim {
namespace {

using Family = std::pair<std::string_view, cv::aruco::PREDEFINED_DICTIONARY_NAME>;

constexpr std::array<Family, 21> kFamilies{{
    {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"aruco_4x4_50", cv::aruco::DICT_4X4_50},
    {"aruco_4x4_100", cv::aruco::DICT_4X4_100},
    {"aruco_4x4_250", cv::aruco::DICT_4X4_250},
    {"aruco_4x4_1000", cv::aruco::DICT_4X4_1000},
    {"aruco_5x5_50", cv::aruco::DICT_5X5_50},
    {"aruco_5x5_100", cv::aruco::DICT_5X5_100},
    {"aruco_5x5_250", cv::aruco::DICT_5X5_250},
    {"aruco_5x5_1000", cv::aruco::DICT_5X5_1000},
    {"aruco_6x6_50", cv::aruco::DICT_6X6_50},
    {"aruco_6x6_100", cv::aruco::DICT_6X6_100},
    {"aruco_6x6_250", cv::aruco::DICT_6X6_250},
    {"aruco_6x6_1000", cv::aruco::DICT_6X6_1000},
    {"aruco_7x7_50", cv::aruco::DICT_7X7_50},
    {"aruco_7x7_100", cv::aruco::DICT_7X7_100},
    {"aruco_7x7_250", cv::aruco::DICT_7X7_250},
    {"aruco_7x7_1000", cv::aruco::DICT_7X7_1000},
    {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"apriltag_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

constexpr double kInkGrainSize = 22e-6;  // m, toner clusters and paper fibres
constexpr double kInkEdgeSize = 45e-6;   // m, correlation length of the ink's edge
constexpr double kCutSize = 140e-6;      // m, correlation length of the scissors' edge
constexpr double kMaxRaggedness = 3.0;   // standard deviations; the texture ends there

constexpr std::string_view kGrid = "grid_10x10";  // host/core/grid_tags.h

const Family* find_family(const std::string& name) {
  const auto* found = std::find_if(kFamilies.begin(), kFamilies.end(),
                                   [&](const Family& f) { return f.first == name; });
  return found == kFamilies.end() ? nullptr : found;
}

// The black frame around across x across cells.
template <typename IsWhite>
TagCells framed(int across, const IsWhite& is_white) {
  TagCells cells;
  cells.across = across + 2;
  cells.black.assign(static_cast<std::size_t>(cells.across * cells.across), true);
  for (int row = 0; row < across; ++row) {
    for (int column = 0; column < across; ++column) {
      cells.black[static_cast<std::size_t>((row + 1) * cells.across + column + 1)] =
          !is_white(row, column);
    }
  }
  return cells;
}

double overlap(double a0, double a1, double b0, double b1) {
  return std::max(0.0, std::min(a1, b1) - std::max(a0, b0));
}

// The ink with every black cell grown on both sides along x and along y, as area coverage. Growth
// cuts each axis into strips: one around every line between cells (it belongs to both neighbours)
// and one inside of every cell.
class InkCoverage {
 public:
  InkCoverage(const TagCells& cells, double size, double spread_x, double spread_y)
      : cells_(cells),
        cell_(size / cells.across),
        start_(-0.5 * size),
        spread_x_(spread_x),
        spread_y_(spread_y) {}

  /// Share of the rectangle that is black.
  double operator()(double x0, double x1, double y0, double y1) const {
    const Range columns = strips(x0, x1, spread_x_);
    const Range rows = strips(y0, y1, spread_y_);
    double area = 0;
    for (int row = rows.first; row <= rows.last; ++row) {
      const double height = strip_overlap(row, y0, y1, spread_y_);
      if (height <= 0) continue;
      for (int column = columns.first; column <= columns.last; ++column)
        if (black(column, row)) area += height * strip_overlap(column, x0, x1, spread_x_);
    }
    return area / ((x1 - x0) * (y1 - y0));
  }

 private:
  struct Range {
    int first, last;
  };

  // Strip 2i lies around line i, strip 2i + 1 inside of cell i.
  Range strips(double a0, double a1, double spread) const {
    const int first = 2 * static_cast<int>(std::floor((a0 - spread - start_) / cell_));
    const int last = 2 * static_cast<int>(std::ceil((a1 + spread - start_) / cell_));
    return {std::max(first, 0), std::min(last, 2 * cells_.across)};
  }

  double strip_overlap(int strip, double a0, double a1, double spread) const {
    const double line = start_ + (strip / 2) * cell_;
    return strip % 2 == 0 ? overlap(line - spread, line + spread, a0, a1)
                          : overlap(line + spread, line + cell_ - spread, a0, a1);
  }

  bool black(int column_strip, int row_strip) const {
    const auto cells = [](int strip) {
      return strip % 2 == 0 ? Range{strip / 2 - 1, strip / 2} : Range{strip / 2, strip / 2};
    };
    const Range columns = cells(column_strip);
    const Range rows = cells(row_strip);
    for (int row = std::max(rows.first, 0); row <= std::min(rows.last, cells_.across - 1); ++row) {
      for (int c = std::max(columns.first, 0); c <= std::min(columns.last, cells_.across - 1); ++c)
        if (cells_.is_black(c, row)) return true;
    }
    return false;
  }

  const TagCells& cells_;
  double cell_, start_, spread_x_, spread_y_;
};

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

constexpr double kDirtEdge = 0.03e-3;      // m, softness of the outline
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
  t.each([&](double x, double y, Texel& texel) {
    const double share = std::clamp(0.5 - mark.distance(x, y) / kDirtEdge, 0.0, 1.0);
    if (share <= 0) return;
    // Texels hold reflectance times coverage; dirt lies on paper alone.
    const double paper = texel.coverage;
    texel.reflectance =
        static_cast<float>(texel.reflectance + share * (reflectance * paper - texel.reflectance));
  });
}

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

bool family_exists(const std::string& family) {
  return family == kGrid || find_family(family) != nullptr;
}

int family_size(const std::string& family) {
  if (family == kGrid) return kGridIds;
  const Family* found = find_family(family);
  return found == nullptr ? 0 : cv::aruco::getPredefinedDictionary(found->second)->bytesList.rows;
}

TagCells tag_cells(const std::string& family, int id) {
  if (family == kGrid)
    return framed(kGridCells, [id](int row, int column) { return grid_is_white(id, row, column); });
  const auto dictionary = cv::aruco::getPredefinedDictionary(find_family(family)->second);
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
      dictionary->bytesList.rowRange(id, id + 1), dictionary->markerSize);
  return framed(bits.cols,
                [&bits](int row, int column) { return bits.at<std::uint8_t>(row, column) != 0; });
}

Texture print_tag(const Target& target, const PrintFault& fault, const TagCells& cells,
                  double texels_per_m, std::uint64_t seed) {
  const double half_paper = 0.5 * target.tag_size + target.border;
  const double half = half_paper + kMaxRaggedness * target.paper_raggedness;
  Texture t = Texture::of_size(half, half, texels_per_m);
  Random random(seed, kPrint);
  const SmoothNoise ink_x(random, kInkEdgeSize), ink_y(random, kInkEdgeSize);
  const SmoothNoise cut_x(random, kCutSize), cut_y(random, kCutSize);
  const SmoothNoise grain(random, kInkGrainSize);
  const InkCoverage ink(cells, target.tag_size, target.ink_spread + fault.growth.x(),
                        target.ink_spread + fault.growth.y());
  const double h = 0.5 / texels_per_m;
  const double limit = kMaxRaggedness * target.paper_raggedness;
  t.each([&](double x, double y, Texel& texel) {
    const double cx = x + std::clamp(target.paper_raggedness * cut_x(x, y), -limit, limit);
    const double cy = y + std::clamp(target.paper_raggedness * cut_y(x, y), -limit, limit);
    const double paper = overlap(cx - h, cx + h, -half_paper, half_paper) *
                         overlap(cy - h, cy + h, -half_paper, half_paper) / (4 * h * h);
    const Eigen::Vector2d drawn = fault.drawn({x, y});
    const double ix = drawn.x() + target.ink_edge_roughness * ink_x(x, y);
    const double iy = drawn.y() + target.ink_edge_roughness * ink_y(x, y);
    const double black = ink(ix - h, ix + h, iy - h, iy + h);
    const double clean =
        target.paper_reflectance + black * (target.ink_reflectance - target.paper_reflectance);
    const double reflectance = std::clamp(clean + target.ink_grain * grain(x, y), 0.0, 1.0);
    texel = {static_cast<float>(paper * reflectance), static_cast<float>(paper)};
  });
  return t;
}

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

Texture print_plate(const Mechanics& mechanics, double half_x, double half_y, double texels_per_m,
                    std::uint64_t seed) {
  Texture t = Texture::of_size(half_x, half_y, texels_per_m);
  Random random(seed, kPlate);
  const SmoothNoise stains(random, 1.3e-3), scratches(random, 0.12e-3), grain(random, 0.04e-3);
  const double sx = mechanics.spring_half_spacing_x;
  const double sy = mechanics.spring_half_spacing_y;
  t.each([&](double x, double y, Texel& texel) {
    const double diagonal = (x - y) / std::numbers::sqrt2 + 0.05e-3 * stains(x, y);
    const double lines = 0.035 * std::sin(kTau * diagonal / kFilamentWidth);
    const double gouge = 0.05 * std::max(scratches(0.4 * (x - y), 1.6 * (x + y)) - 1.2, 0.0);
    double shade = kPlateReflectance + lines + gouge + 0.025 * stains(y, x) + 0.012 * grain(x, y);
    shade = draw_screw(shade, x, y, -kScrewX);
    shade = draw_screw(shade, x, y, kScrewX);
    for (const double side_x : {-sx, sx})
      for (const double side_y : {-sy, sy}) shade = draw_spring(shade, x, y, side_x, side_y);
    texel = {static_cast<float>(std::clamp(shade, 0.02, 1.0)), 1};
  });
  return t;
}

Texture print_pad(double half_paper, double margin, double texels_per_m, std::uint64_t seed) {
  const double half_x = half_paper + margin;
  const double half_y = half_paper + 0.35 * margin;
  Texture t = Texture::of_size(half_x, half_y, texels_per_m);
  Random random(seed, kPlate + 1);
  const SmoothNoise glue(random, 0.5e-3), grain(random, 0.06e-3);
  t.each([&](double x, double y, Texel& texel) {
    const double cover = inside(std::abs(x) - half_x) * inside(std::abs(y) - half_y);
    const double lines = 0.03 * std::sin(kTau * x / 0.21e-3);
    const double shade = kPadReflectance + lines + 0.04 * glue(x, y) + 0.01 * grain(x, y);
    texel = {static_cast<float>(cover * std::clamp(shade, 0.0, 1.0)), static_cast<float>(cover)};
  });
  return t;
}

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
    for (int v = 0; v < t.height; ++v)
      for (int u = 0; u < t.width; ++u)
        wide[out.index(u + more, v + more)] = t.texels[t.index(u, v)].*part;
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
