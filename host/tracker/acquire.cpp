#include "host/tracker/acquire.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <string>

#include "host/core/algebra/levenberg_marquardt.h"
#include "host/core/config_error.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

using Rays = Square;  ///< at z = 1

bool contains(const auto& ids, int id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

std::optional<Rays> rays_of(const CameraModel& camera, const Square& corners) {
  Rays rays;
  for (std::size_t c = 0; c < 4; ++c) {
    const auto ray = unproject(camera, corners[c]);
    if (!ray) return std::nullopt;
    rays[c] = ray->head<2>();
  }
  return rays;
}

/// The least-squares translation that goes with a rotation.
Eigen::Vector3d translation(const Rays& rays, const Eigen::Matrix3d& rotation, double half) {
  // Each corner gives two rows, (1 0 -x) and (0 1 -y); these are their normal equations.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  const std::array<Eigen::Vector3d, 4> on_tag = square_corners(half);
  for (std::size_t c = 0; c < 4; ++c) {
    const Eigen::Vector3d arm = rotation * on_tag[c];
    const Eigen::Vector2d& ray = rays[c];
    Eigen::Matrix<double, 2, 3> rows;
    rows << 1, 0, -ray.x(), 0, 1, -ray.y();
    normal += rows.transpose() * rows;
    rhs += rows.transpose() * (ray * arm.z() - arm.head<2>());
  }
  return normal.inverse() * rhs;
}

double squares_px(const CameraModel& camera, const Eigen::Isometry3d& pose, double half,
                  const Square& corners) {
  double sum = 0;
  const std::array<Eigen::Vector3d, 4> on_tag = square_corners(half);
  for (std::size_t c = 0; c < 4; ++c)
    sum += (project(camera, pose * on_tag[c]).pixel - corners[c]).squaredNorm();
  return sum;
}

constexpr int kCell_px = 8;        ///< of the picture that is read
constexpr int kMargin_px = 2;      ///< of a cell, not looked at
constexpr double kMinCell_px = 4;  ///< of the square in the image
constexpr std::size_t kMaxSquares = 12;
/// Of the looked-at pixels of all cells, those that may differ from most of their cell's.
constexpr double kMaxImpure = 0.06;
constexpr double kMinContrast = 30;  ///< grey levels, between black and white
constexpr double kMinWhite = 0.1;    ///< of the cells inside the border; and of black ones

/// Families that hold all others of their size.
constexpr TagFamily kLargest[] = {
    TagFamily::aruco_original, TagFamily::aruco_4x4_1000, TagFamily::aruco_5x5_1000,
    TagFamily::aruco_6x6_1000, TagFamily::aruco_7x7_1000, TagFamily::apriltag_16h5,
    TagFamily::apriltag_25h9,  TagFamily::apriltag_36h10, TagFamily::apriltag_36h11,
    TagFamily::grid_10x10,
};
/// Those of aruco_NxN with fewer ids come right before it in TagFamily, the smallest first.
constexpr int kSmaller = 3;

struct Bits {
  /// Row by row, 1 is white; empty: not a tag of this many cells.
  std::vector<std::uint8_t> inside;
  double impurity = 1;  ///< part of the pixels that differ from their cell
};

/// A picture of the square alone, rows of cells * kCell_px pixels; 0 outside of the image.
class FlatSquare {
 public:
  FlatSquare(const ImageView& image, const Square& square, int cells)
      : side_(cells * kCell_px), level_(static_cast<std::size_t>(side_ * side_)) {
    const Eigen::Matrix3d image_from_flat = square_homography(square);
    for (int row = 0; row < side_; ++row) {
      for (int column = 0; column < side_; ++column) {
        const Eigen::Vector3d at =
            image_from_flat * Eigen::Vector3d(2.0 * column / side_ - 1, 2.0 * row / side_ - 1, 1);
        level_[index(row, column)] = interpolated(image, at.x() / at.z(), at.y() / at.z());
      }
    }
    // The level that parts black and white best (Otsu, IEEE Trans. SMC 9, 1979), and their means.
    std::array<int, 256> histogram{};
    double all = 0;
    for (const std::uint8_t level : level_) {
      ++histogram[level];
      all += level;
    }
    const auto count = static_cast<double>(level_.size());
    double below = 0, sum = 0, best = 0;
    for (int level = 0; level < 255; ++level) {
      below += histogram[static_cast<std::size_t>(level)];
      sum += static_cast<double>(level) * histogram[static_cast<std::size_t>(level)];
      if (below == 0 || below == count) continue;
      const double black = sum / below, white = (all - sum) / (count - below);
      const double between = below * (count - below) * (white - black) * (white - black);
      if (between <= best) continue;
      best = between;
      threshold_ = level;
      contrast_ = white - black;
    }
  }

  double contrast() const { return contrast_; }
  /// White pixels of a cell, its margins left out.
  int white_in(int cell_row, int cell_column) const {
    int white = 0;
    for (int row = kMargin_px; row < kCell_px - kMargin_px; ++row) {
      for (int column = kMargin_px; column < kCell_px - kMargin_px; ++column)
        white +=
            level_[index(cell_row * kCell_px + row, cell_column * kCell_px + column)] > threshold_;
    }
    return white;
  }

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row * side_ + column);
  }
  static std::uint8_t interpolated(const ImageView& image, double x, double y) {
    if (!(x >= 0 && y >= 0 && x < image.width - 1 && y < image.height - 1)) return 0;
    const auto left = static_cast<int>(x), top = static_cast<int>(y);
    const std::uint8_t* at = image.pixels + static_cast<std::ptrdiff_t>(top) * image.stride + left;
    const double u = x - left, v = y - top;
    const double upper = at[0] + u * (at[1] - at[0]);
    const double lower = at[image.stride] + u * (at[image.stride + 1] - at[image.stride]);
    return static_cast<std::uint8_t>(std::lround(upper + v * (lower - upper)));
  }

  int side_;
  std::vector<std::uint8_t> level_;
  int threshold_ = 0;
  double contrast_ = 0;
};

Bits read_bits(const ImageView& image, const Square& square, int bits) {
  const int cells = bits + 2;
  const FlatSquare flat(image, square, cells);
  Bits read;
  if (flat.contrast() < kMinContrast) return read;

  constexpr int kLook_px = kCell_px - 2 * kMargin_px;
  std::vector<std::uint8_t> inside;
  int differing = 0, white_cells = 0;
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const int white = flat.white_in(row, column);
      const bool is_white = 2 * white > kLook_px * kLook_px;
      differing += is_white ? kLook_px * kLook_px - white : white;
      const bool border = row == 0 || column == 0 || row == cells - 1 || column == cells - 1;
      if (border && is_white) return read;
      if (border) continue;
      inside.push_back(is_white ? 1 : 0);
      white_cells += is_white ? 1 : 0;
    }
  }
  const double white_fraction = static_cast<double>(white_cells) / (bits * bits);
  if (white_fraction < kMinWhite || white_fraction > 1 - kMinWhite) return read;
  read.impurity = static_cast<double>(differing) / (cells * cells * kLook_px * kLook_px);
  if (read.impurity < kMaxImpure) read.inside = std::move(inside);
  return read;
}

TagFamily smallest(TagFamily family, int id) {
  const auto last = static_cast<int>(family);
  if (last - kSmaller < static_cast<int>(TagFamily::aruco_4x4_50) ||
      family > TagFamily::aruco_7x7_1000)
    return family;
  for (int f = last - kSmaller; f < last; ++f)
    if (id < id_count(static_cast<TagFamily>(f))) return static_cast<TagFamily>(f);
  return family;
}

std::optional<ReadSquare> recognise(const std::vector<std::uint8_t>& white, int bits,
                                    TagFamily expected, std::span<const std::int16_t> missing) {
  if (bits_per_side(expected) == bits) {
    std::vector<std::uint8_t> flipped = white;
    for (auto row = flipped.begin(); row != flipped.end(); row += bits)
      std::reverse(row, row + bits);
    const auto id = identify_tag(expected, flipped);
    if (id && contains(missing, *id)) return ReadSquare{expected, *id, true};
    if (const auto as_it_is = identify_tag(expected, white))
      return ReadSquare{expected, *as_it_is, false};
  }
  for (const TagFamily family : kLargest) {
    if (bits_per_side(family) != bits) continue;
    if (const auto id = identify_tag(family, white))
      return ReadSquare{smallest(family, *id), *id, false};
  }
  return std::nullopt;
}

/// Cells of the wrong size do not fill with one colour: the purest reading that is a tag counts.
std::optional<ReadSquare> read_square(const ImageView& image, const Square& square,
                                      TagFamily expected, std::span<const std::int16_t> missing) {
  std::optional<ReadSquare> best;
  double least = 1;
  for (const int bits : {4, 5, 6, 7, bits_per_side(TagFamily::grid_10x10)}) {
    if (shortest_side(square) < kMinCell_px * (bits + 2)) continue;
    const Bits read = read_bits(image, square, bits);
    if (read.inside.empty() || read.impurity >= least) continue;
    const std::optional<ReadSquare> tag = recognise(read.inside, bits, expected, missing);
    if (!tag) continue;
    best = tag;
    least = read.impurity;
  }
  return best;
}

/// While nothing is found, every so many frames the image is tried the other way round.
constexpr unsigned kFlipEvery = 4;

/// Families of so many cells a side are looked for in a sharpened image too.
constexpr int kFineCells = 8;

void check(const TargetDescription& target) {
  const auto refuse = [](const std::string& line) { throw ConfigError("target." + line); };
  const auto text = [](auto number) { return std::to_string(number); };
  const std::size_t count = target.tags.size();
  if (count == 0) refuse("tags: is empty; list at least one tag id");
  if (count > std::size_t{kMaxTags})
    refuse("tags: " + text(count) + " tags; use at most " + text(kMaxTags));
  if (!(target.tag_size > 0)) refuse("tag_size_mm: must be positive");
  if (!(target.border >= 0)) refuse("border_mm: must not be negative");
  const int ids = id_count(target.family);
  for (auto tag = target.tags.begin(); tag != target.tags.end(); ++tag) {
    if (tag->id < 0 || tag->id >= ids) {
      refuse("tags: id " + text(tag->id) + " is not in " + std::string(name(target.family)) +
             "; use 0 to " + text(ids - 1));
    }
    const auto same = [tag](const Tag& other) { return other.id == tag->id; };
    if (std::any_of(target.tags.begin(), tag, same))
      refuse("tags: id " + text(tag->id) + " is listed twice; give each tag its own");
  }
}

Eigen::Vector2d centre(const Square& square) {
  return 0.25 * (square[0] + square[1] + square[2] + square[3]);
}

double perimeter(const Square& square) {
  double sum = 0;
  for (std::size_t c = 0; c < 4; ++c) sum += (square[(c + 1) % 4] - square[c]).norm();
  return sum;
}

/// Where the id is in the detector's list. The thresholded rim of one square has an inside and an
/// outside, and both may be listed: the outside is the square. An id in two places cannot be told
/// apart from its double.
std::optional<std::size_t> only(int id, const SquareList& list, bool& twice) {
  constexpr double kSamePlaceFraction = 0.1;  // of the square's perimeter
  std::optional<std::size_t> best;
  twice = false;
  double longest_px = 0;
  for (std::size_t i = 0; i < list.ids.size(); ++i) {
    if (list.ids[i] != id) continue;
    const double perimeter_px = perimeter(list.tags[i]);
    if (best && (centre(list.tags[i]) - centre(list.tags[*best])).norm() >
                    kSamePlaceFraction * perimeter_px) {
      twice = true;
      return std::nullopt;
    }
    if (perimeter_px <= longest_px) continue;
    longest_px = perimeter_px;
    best = i;
  }
  return best;
}

/// What was found, sorted by what the target has.
Finding sorted(const CameraModel& camera, const TargetDescription& target, SquareList list) {
  Finding finding;
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    bool twice = false;
    const std::optional<std::size_t> seen = only(target.tags[t].id, list, twice);
    if (twice) finding.twice.push_back(target.tags[t].id);
    if (!seen) continue;
    const Square& corners_px = list.tags[*seen];
    auto poses = square_poses(camera, target.tag_size, corners_px);
    if (!poses.empty()) finding.tags.push_back({t, corners_px, std::move(poses)});
  }
  finding.squares = std::move(list.others);
  for (std::size_t i = 0; i < list.ids.size(); ++i) {
    const auto same = [id = list.ids[i]](const Tag& tag) { return tag.id == id; };
    if (std::any_of(target.tags.begin(), target.tags.end(), same)) continue;
    finding.squares.push_back(list.tags[i]);
    if (!contains(finding.other_ids, list.ids[i])) finding.other_ids.push_back(list.ids[i]);
  }
  return finding;
}

constexpr double kReachRotation = 0.6;  ///< rad
constexpr double kReachDistance = 0.5;  ///< translation, of the distance from the lens at rest
constexpr double kUnfit_px = 8.0;       ///< RMS beyond which corners are not the target's

struct CornerPair {
  Eigen::Vector3d p_platform;
  Eigen::Vector2d pixel;
};

/// Moves `pose` to the least squares near it; their RMS, px, infinite where a point is behind the
/// camera.
double fit_corners(const CameraModel& camera, const std::vector<CornerPair>& pairs,
                   Eigen::Isometry3d& pose) {
  const auto look = [&](const Eigen::Isometry3d& at) {
    FitSums<6> sums;
    for (const CornerPair& pair : pairs) {
      const Eigen::Vector3d arm = at.linear() * pair.p_platform;
      const ProjectedPoint projected = project(camera, arm + at.translation());
      if (!projected.valid) sums.squares = std::numeric_limits<double>::infinity();
      Eigen::Matrix<double, 2, 6> rows;
      rows << projected.jacobian, -projected.jacobian * cross_matrix(arm);
      const Eigen::Vector2d error = pair.pixel - projected.pixel;
      for (int i = 0; i < 2; ++i) sums.add(rows.row(i).transpose(), error[i]);
    }
    return sums;
  };
  const double squares = levenberg_marquardt(pose, look, moved).squares;
  return std::sqrt(squares / (2.0 * static_cast<double>(pairs.size())));
}

}  // namespace

/// In closed form (Heckbert, "Fundamentals of texture mapping and image warping", 1989, 2.2.3).
Eigen::Matrix3d square_homography(const Square& corners) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const Eigen::Vector2d odd = corners[0] - corners[1] + corners[2] - corners[3];
  const Eigen::Vector2d right = corners[1] - corners[2];
  const Eigen::Vector2d bottom = corners[3] - corners[2];
  const double g = cross(odd, bottom) / cross(right, bottom);
  const double h = cross(right, odd) / cross(right, bottom);
  const Eigen::Vector2d along = corners[1] - corners[0] + g * corners[1];
  const Eigen::Vector2d down = corners[3] - corners[0] + h * corners[3];
  Eigen::Matrix3d from_corner;  // 0 to 1 to the right and down
  from_corner << along.x(), down.x(), corners[0].x(), along.y(), down.y(), corners[0].y(), g, h, 1;
  Eigen::Matrix3d corner_from_centre;
  corner_from_centre << 0.5, 0, 0.5, 0, 0.5, 0.5, 0, 0, 1;
  const Eigen::Matrix3d out = from_corner * corner_from_centre;
  return out / out(2, 2);
}

std::vector<Eigen::Isometry3d> square_poses(const CameraModel& camera, double size,
                                            const Square& corners) {
  const std::optional<Rays> rays = rays_of(camera, corners);
  if (!rays) return {};
  // The homography's derivative at the centre, and the rotation of the optical axis to there.
  const Eigen::Matrix3d h = square_homography(*rays);
  const Eigen::Vector2d centre = h.topRightCorner<2, 1>();
  const Eigen::Matrix2d derivative = h.topLeftCorner<2, 2>() - centre * h.bottomLeftCorner<1, 2>();
  if (!h.allFinite()) return {};
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), centre.homogeneous())
          .toRotationMatrix();
  const Eigen::Matrix2d facing =
      (turn.topLeftCorner<2, 2>() - centre * turn.bottomLeftCorner<1, 2>()).inverse() * derivative;
  // Its larger singular value is the scale; what is left is the upper left of a rotation.
  const Eigen::Matrix2d gram = facing * facing.transpose();
  const double mean = 0.5 * gram.trace();
  const double scale = std::sqrt(mean + std::hypot(0.5 * (gram(0, 0) - gram(1, 1)), gram(0, 1)));
  const Eigen::Matrix2d upper = facing / scale;
  const double third = std::sqrt(std::max(0.0, 1 - upper.col(0).squaredNorm()));
  const double fourth = std::copysign(std::sqrt(std::max(0.0, 1 - upper.col(1).squaredNorm())),
                                      -upper.col(0).dot(upper.col(1)));

  const double half = 0.5 * size;
  std::vector<Eigen::Isometry3d> poses;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Matrix3d rotation;
    rotation.col(0) << upper.col(0), sign * third;
    rotation.col(1) << upper.col(1), sign * fourth;
    rotation.col(2) = rotation.col(0).cross(rotation.col(1));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = turn * rotation;
    pose.translation() = translation(*rays, pose.linear(), half);
    const bool faces_us = pose.linear().col(2).dot(pose.translation()) > 0;
    if (pose.matrix().allFinite() && pose.translation().z() > 0 && faces_us) poses.push_back(pose);
  }
  std::stable_sort(poses.begin(), poses.end(), [&](const auto& a, const auto& b) {
    return squares_px(camera, a, half, corners) < squares_px(camera, b, half, corners);
  });
  return poses;
}

std::vector<ReadSquare> read_squares(const ImageView& image, const std::vector<Square>& squares,
                                     TagFamily expected, std::span<const std::int16_t> missing) {
  std::vector<Square> largest = squares;
  const std::size_t most = std::min(largest.size(), kMaxSquares);
  std::partial_sort(
      largest.begin(), largest.begin() + static_cast<std::ptrdiff_t>(most), largest.end(),
      [](const Square& a, const Square& b) { return shortest_side(a) > shortest_side(b); });
  largest.resize(most);
  std::vector<ReadSquare> tags;
  for (const Square& square : largest)
    if (const auto tag = read_square(image, square, expected, missing)) tags.push_back(*tag);
  return tags;
}

Acquirer::Acquirer(const CameraModel& camera, const TargetDescription& target)
    : camera_(camera), target_((check(target), target)), finder_(target.family) {
  for (const Tag& tag : target.tags)
    patterns_.push_back(tag_pattern(target.family, tag.id, target.tag_size, target.border));
}

/// Blur as wide as a third of a cell hides the bits from the library's thresholds: tags not yet
/// listed are looked for in a sharpened image.
void Acquirer::add_sharpened(const ImageView& image, SquareList& list) {
  if (std::all_of(target_.tags.begin(), target_.tags.end(),
                  [&](const Tag& tag) { return contains(list.ids, tag.id); }))
    return;
  const std::optional<SquareList> more = finder_.find(image, true);
  if (!more) return;
  const std::vector<int> first = list.ids;
  for (std::size_t i = 0; i < more->ids.size(); ++i) {
    if (contains(first, more->ids[i])) continue;
    list.ids.push_back(more->ids[i]);
    list.tags.push_back(more->tags[i]);
  }
}

Finding Acquirer::detect(const ImageView& image, const Eigen::Vector2d& origin) {
  std::optional<SquareList> list = finder_.find(image, false);
  if (!list) return {.looked = false};
  if (bits_per_side(target_.family) >= kFineCells) add_sharpened(image, *list);
  for (std::vector<Square>* squares : {&list->tags, &list->others})
    for (Square& square : *squares)
      for (Eigen::Vector2d& corner : square) corner += origin;
  return sorted(camera_, target_, std::move(*list));
}

Finding Acquirer::find(const ImageView& image) {
  std::optional<FlippedImage> flipped;
  if (camera_.mirrored) flipped.emplace(image);
  Finding finding = detect(flipped ? flipped->view() : image, {0, 0});
  if (!finding.tags.empty()) {
    misses_ = 0;
    return finding;
  }
  if (!finding.looked || misses_++ % kFlipEvery != 0) return finding;
  if (!flipped) flipped.emplace(image);
  finding.other_way_round =
      !detect(camera_.mirrored ? image : flipped->view(), {0, 0}).tags.empty();
  return finding;
}

Finding Acquirer::find_in(const ImageView& image, const Region& part) {
  const Region inside = part.clipped(image.width, image.height);
  const ImageView seen{
      image.pixels + static_cast<std::ptrdiff_t>(inside.y) * image.stride + inside.x, inside.width,
      inside.height, image.stride};
  if (!camera_.mirrored) return detect(seen, {inside.x, inside.y});
  const int right = image.width - inside.x - inside.width;
  return detect(FlippedImage(seen).view(), {right, inside.y});
}

bool within_reach(const Eigen::Isometry3d& reference, const Eigen::Isometry3d& camera_T_platform) {
  const Vector6 motion = motion_between(reference, camera_T_platform);
  return motion.tail<3>().norm() < kReachRotation &&
         motion.head<3>().norm() < kReachDistance * reference.translation().norm();
}

std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag, const Eigen::Isometry3d& reference) {
  const std::array<Eigen::Vector3d, 4> corners = square_corners(0.5 * tag_size);
  std::vector<CornerPair> pairs;
  std::vector<Eigen::Isometry3d> starts = {reference};
  for (const FoundTag& tag : found) {
    for (std::size_t c = 0; c < 4; ++c)
      pairs.push_back({platform_T_tag[tag.index] * corners[c], tag.corners_px[c]});
    for (const Eigen::Isometry3d& pose : tag.camera_T_tag)
      starts.push_back(pose * platform_T_tag[tag.index].inverse());
  }
  if (pairs.empty()) return std::nullopt;
  std::optional<Eigen::Isometry3d> best;
  double best_px = kUnfit_px;
  for (Eigen::Isometry3d& pose : starts) {
    const double rms_px = fit_corners(camera, pairs, pose);
    if (!(rms_px < best_px) || !within_reach(reference, pose)) continue;
    best = pose;
    best_px = rms_px;
  }
  return best;
}

void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept {
  track.corner_count = 0;
  if (platform_T_tag.size() != target.tags.size() || target.tags.size() > track.corners.size())
    return;
  const std::array<Eigen::Vector3d, 4> corners = square_corners(0.5 * target.tag_size);
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    TagCorners& out = track.corners[t];
    out.id = target.tags[t].id;
    for (std::size_t c = 0; c < 4; ++c) {
      const ProjectedPoint at =
          project(camera, camera_T_platform * (platform_T_tag[t] * corners[c]));
      if (!at.valid) return;
      const double x = at.pixel.x();
      out.px[2 * c] = camera.mirrored ? camera.width_px - 1 - x : x;
      out.px[2 * c + 1] = at.pixel.y();
    }
  }
  track.corner_count = static_cast<std::uint8_t>(target.tags.size());
}

}  // namespace tagwrench
