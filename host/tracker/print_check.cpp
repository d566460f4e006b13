#include "host/tracker/print_check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/pixel_template.h"

namespace tagwrench {
namespace {

/// Levels from black (0) to white (1) of the same tag: below and above these a cell is clear.
constexpr double kBlack = 0.3;
constexpr double kWhite = 0.7;
constexpr double kMinContrast = 8;  ///< grey levels

constexpr int kMinContradicting = 2;   ///< cells: a single one is dirt
constexpr double kMinClear = 0.75;     ///< of the cells, those that are clearly black or white
constexpr double kMinSurround = 0.85;  ///< of border and margin, what is black and white as it is

/// Where a cell is looked at, from its middle, cells: away from its edges, which blur.
constexpr std::array<double, 3> kAcross = {-0.2, 0.0, 0.2};

constexpr unsigned kBetweenLooks = 8;  ///< frames

constexpr int kMaxCells = kGridCells + 2;
constexpr std::size_t kMaxSamples = 4 * kMaxCells + kMaxCells * kMaxCells;

struct Spot {
  double x = 0, y = 0;  ///< on the tag, of its half
  double level = 0;
};

/// A list on the stack.
struct Spots {
  std::array<Spot, kMaxSamples> all{};
  std::size_t count = 0;

  void add(const Spot& sample) {
    if (count < all.size()) all[count++] = sample;
  }
  std::span<const Spot> list() const { return {all.data(), count}; }
};

using Plane = Eigen::Vector3d;  // 1, x, y

double at(const Plane& plane, double x, double y) { return plane.dot(Plane(1, x, y)); }

/// Through most of the samples: iteratively reweighted least squares, Cauchy's weights.
std::optional<Plane> plane_through(const Spots& samples) {
  constexpr int kRounds = 6;
  constexpr double kRidge = 1e-3;  // slopes of few samples in a line
  if (samples.count < 3) return std::nullopt;
  std::array<double, kMaxSamples> levels;
  for (std::size_t i = 0; i < samples.count; ++i) levels[i] = samples.all[i].level;
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(samples.count / 2);
  std::nth_element(levels.begin(), middle,
                   levels.begin() + static_cast<std::ptrdiff_t>(samples.count));
  Plane plane(*middle, 0, 0);
  for (int round = 0; round < kRounds; ++round) {
    double deviation = 1;  // grey level, that of noise
    for (const Spot& s : samples.list())
      deviation += std::abs(s.level - at(plane, s.x, s.y)) / static_cast<double>(samples.count);
    Eigen::Matrix3d normal = Eigen::Vector3d(0, kRidge, kRidge).asDiagonal();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    for (const Spot& s : samples.list()) {
      const Plane row(1, s.x, s.y);
      const double off = (s.level - plane.dot(row)) / deviation;
      const double weight = 1 / (1 + off * off);
      normal += weight * row * row.transpose();
      rhs += weight * s.level * row;
    }
    plane = normal.inverse() * rhs;
    if (!plane.allFinite()) return std::nullopt;
  }
  return plane;
}

template <class Pixel>
class TagReader {
 public:
  TagReader(const CameraModel& camera, const PixelView<Pixel>& image, const Region& readable,
            const TagPattern& pattern, const Eigen::Isometry3d& camera_T_tag)
      : camera_(camera),
        image_(image),
        readable_(readable),
        pattern_(pattern),
        camera_T_tag_(camera_T_tag),
        cell_(2.0 / pattern.cells) {}

  /// Mean level about a point of the tag; empty where it is out of view. x, y and reach: of the
  /// tag's half.
  std::optional<Spot> sample(double x, double y, double reach) const {
    Spot out{x, y, 0};
    const double half = 0.5 * pattern_.size;
    const ProjectedPoint middle =
        project(camera_, camera_T_tag_ * Eigen::Vector3d(half * x, half * y, 0));
    if (!middle.valid || !middle.pixel.allFinite()) return std::nullopt;
    const Eigen::Matrix2d step =
        half * reach * middle.jacobian * camera_T_tag_.linear().leftCols<2>();
    for (const double down : kAcross) {
      for (const double right : kAcross) {
        const Eigen::Vector2d pixel = middle.pixel + step * Eigen::Vector2d(right, down);
        const double x_px = pixel.x() + 0.5;
        const double y_px = pixel.y() + 0.5;
        if (!(x_px >= readable_.x && x_px < readable_.x + readable_.width && y_px >= readable_.y &&
              y_px < readable_.y + readable_.height))
          return std::nullopt;
        out.level +=
            static_cast<double>(image_.pixels[static_cast<std::ptrdiff_t>(y_px) * image_.stride +
                                              static_cast<std::ptrdiff_t>(x_px)]);
      }
    }
    out.level /= static_cast<double>(kAcross.size() * kAcross.size());
    return out;
  }

  std::optional<Spot> cell(int row, int column) const {
    return sample((column + 0.5) * cell_ - 1, (row + 0.5) * cell_ - 1, cell_);
  }

  /// Beside each cell of the border.
  void margin(Spots& out) const {
    const double reach = std::min(cell_, 2 * pattern_.border / pattern_.size);
    const double edge = 1 + 0.5 * reach;
    for (int i = 0; i < pattern_.cells; ++i) {
      const double along = (i + 0.5) * cell_ - 1;
      for (const auto& [x, y] : {std::pair(along, -edge), std::pair(along, edge),
                                 std::pair(-edge, along), std::pair(edge, along)}) {
        if (const auto seen = sample(x, y, reach)) out.add(*seen);
      }
    }
  }

  void border(Spots& out) const {
    const int last = pattern_.cells - 1;
    for (int row = 0; row <= last; ++row) {
      for (int column = 0; column <= last; ++column) {
        if (row != 0 && row != last && column != 0 && column != last) continue;
        if (const auto seen = cell(row, column)) out.add(*seen);
      }
    }
  }

 private:
  const CameraModel& camera_;
  const PixelView<Pixel>& image_;
  const Region& readable_;
  const TagPattern& pattern_;
  const Eigen::Isometry3d& camera_T_tag_;
  double cell_;  // of the tag's half
};

int differing(const std::array<std::uint64_t, 2>& a, const std::array<std::uint64_t, 2>& b,
              const std::array<std::uint64_t, 2>& among) {
  return std::popcount((a[0] ^ b[0]) & among[0]) + std::popcount((a[1] ^ b[1]) & among[1]);
}

void set(std::array<std::uint64_t, 2>& bits, int n) {
  bits[static_cast<std::size_t>(n / 64)] |= std::uint64_t{1} << (n % 64);
}

}  // namespace

PrintCheck::PrintCheck(const CameraModel& camera, TagFamily family,
                       std::vector<TagPattern> patterns)
    : camera_(raw_camera(camera)), patterns_(std::move(patterns)) {
  const int bits = bits_per_side(family);
  const int last = bits - 1;
  known_.reserve(4 * static_cast<std::size_t>(id_count(family)));
  for (int id = 0; id < id_count(family); ++id) {
    const TagPattern pattern = tag_pattern(family, id, 1, 0);
    std::array<Known, 4> turned{Known{id}, Known{id}, Known{id}, Known{id}};
    for (int row = 0; row < bits; ++row) {
      for (int column = 0; column < bits; ++column) {
        if (!pattern.is_white(row + 1, column + 1)) continue;
        set(turned[0].white, row * bits + column);
        set(turned[1].white, column * bits + last - row);
        set(turned[2].white, (last - row) * bits + last - column);
        set(turned[3].white, (last - column) * bits + row);
      }
    }
    known_.insert(known_.end(), turned.begin(), turned.end());
  }
}

PrintReading PrintCheck::compare(std::size_t tag, const Bits& white,
                                 const Bits& clear) const noexcept {
  const int id = patterns_[tag].id;
  const Bits& own = known_[4 * static_cast<std::size_t>(id)].white;
  if (differing(own, white, clear) < kMinContradicting) return {PrintReading::Verdict::agrees, id};
  const auto seen = std::find_if(known_.begin(), known_.end(), [&](const Known& other) {
    return other.id != id && differing(other.white, white, clear) == 0;
  });
  if (seen == known_.end()) return {};
  return {PrintReading::Verdict::other, seen->id};
}

template <class Pixel>
PrintReading PrintCheck::look(const PixelView<Pixel>& image, const Region& readable,
                              std::size_t tag,
                              const Eigen::Isometry3d& camera_T_tag) const noexcept {
  const TagPattern& pattern = patterns_[tag];
  const TagReader<Pixel> reader(camera_, image, readable, pattern, camera_T_tag);
  Spots border, whites;
  reader.border(border);
  reader.margin(whites);
  const std::size_t margin = whites.count;
  const int inside = pattern.cells - 2;
  std::array<std::optional<Spot>, kGridCells * kGridCells> cells;
  for (int n = 0; n < inside * inside; ++n) {
    auto& cell = cells[static_cast<std::size_t>(n)];
    cell = reader.cell(1 + n / inside, 1 + n % inside);
    // Most of a tag's white cells are white in one that looks like it.
    if (cell && pattern.is_white(1 + n / inside, 1 + n % inside)) whites.add(*cell);
  }
  const std::optional<Plane> black = plane_through(border);
  const std::optional<Plane> light = plane_through(whites);
  if (!black || !light) return {};
  const auto brightness = [&](const Spot& s) {
    const double dark = at(*black, s.x, s.y);
    return (s.level - dark) / std::max(kMinContrast, at(*light, s.x, s.y) - dark);
  };
  const auto dark = [&](const Spot& s) { return brightness(s) < kBlack; };
  const auto bright = [&](const Spot& s) { return brightness(s) > kWhite; };
  const auto most = [](std::span<const Spot> spots, int of, const auto& fits) {
    return std::count_if(spots.begin(), spots.end(), fits) >= kMinSurround * of;
  };
  if (!most(border.list(), 4 * (pattern.cells - 1), dark) ||
      !most(whites.list().first(margin), 4 * pattern.cells, bright))
    return {};
  Bits white{}, clear{};
  int known = 0;
  for (int n = 0; n < inside * inside; ++n) {
    const auto& cell = cells[static_cast<std::size_t>(n)];
    if (!cell) continue;
    const double level = brightness(*cell);
    if (level > kBlack && level < kWhite) continue;
    ++known;
    set(clear, n);
    if (level >= kWhite) set(white, n);
  }
  return known < kMinClear * inside * inside ? PrintReading{} : compare(tag, white, clear);
}

PrintReading PrintCheck::read(const ImageView& image, const Region& readable, std::size_t tag,
                              const Eigen::Isometry3d& camera_T_tag) const noexcept {
  return look(pixel_view(image), readable, tag, camera_T_tag);
}

PrintReading PrintCheck::read(const PixelView<float>& image, std::size_t tag,
                              const Eigen::Isometry3d& camera_T_tag) const noexcept {
  return look(image, Region{0, 0, image.width, image.height}, tag, camera_T_tag);
}

bool PrintWatch::agrees(const Frame& frame, const Eigen::Isometry3d& camera_T_platform,
                        const std::vector<Eigen::Isometry3d>& platform_T_tag, bool anew) noexcept {
  const bool all = anew || other_;
  const unsigned now = frames_++;
  if (!all && now % kBetweenLooks != 0) return true;
  for (std::size_t t = 0; t < tags_; ++t) {
    if (!all && t != now / kBetweenLooks % tags_) continue;
    const PrintReading seen =
        check_.read(frame.image, frame.readable(), t, camera_T_platform * platform_T_tag[t]);
    if (seen.verdict == PrintReading::Verdict::other)
      other_ = OtherPrint{t, seen.other_id};
    else if (seen.verdict == PrintReading::Verdict::agrees && other_ && other_->tag == t)
      other_.reset();
  }
  return !other_;
}

}  // namespace tagwrench
