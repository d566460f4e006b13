// The rigid target under the platform: which tags, how large, their cells as printed, and where
// they sit, as far as that is known.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "host/core/grid_tags.h"
#include "host/core/types.h"

namespace tagwrench {

// clang-format off
enum class TagFamily : std::uint8_t {
  aruco_original,
  aruco_4x4_50, aruco_4x4_100, aruco_4x4_250, aruco_4x4_1000,
  aruco_5x5_50, aruco_5x5_100, aruco_5x5_250, aruco_5x5_1000,
  aruco_6x6_50, aruco_6x6_100, aruco_6x6_250, aruco_6x6_1000,
  aruco_7x7_50, aruco_7x7_100, aruco_7x7_250, aruco_7x7_1000,
  apriltag_16h5, apriltag_25h9, apriltag_36h10, apriltag_36h11,
  grid_10x10,
};
// clang-format on

constexpr int kTagFamilies = 22;

/// A target may carry at most this many tags.
constexpr int kMaxTags = 8;

struct FamilyRow {
  std::string_view name;  ///< as sensor.yaml writes it
  int bits;               ///< data bits along one side; the black square is two cells wider
  int ids;                ///< they run from 0 to one less
};

/// In the order of TagFamily; grid_10x10: host/core/grid_tags.h.
constexpr std::array<FamilyRow, kTagFamilies> kFamilies = {{
    {"aruco_original", 5, 1024}, {"aruco_4x4_50", 4, 50},
    {"aruco_4x4_100", 4, 100},   {"aruco_4x4_250", 4, 250},
    {"aruco_4x4_1000", 4, 1000}, {"aruco_5x5_50", 5, 50},
    {"aruco_5x5_100", 5, 100},   {"aruco_5x5_250", 5, 250},
    {"aruco_5x5_1000", 5, 1000}, {"aruco_6x6_50", 6, 50},
    {"aruco_6x6_100", 6, 100},   {"aruco_6x6_250", 6, 250},
    {"aruco_6x6_1000", 6, 1000}, {"aruco_7x7_50", 7, 50},
    {"aruco_7x7_100", 7, 100},   {"aruco_7x7_250", 7, 250},
    {"aruco_7x7_1000", 7, 1000}, {"apriltag_16h5", 4, 30},
    {"apriltag_25h9", 5, 35},    {"apriltag_36h10", 6, 2320},
    {"apriltag_36h11", 6, 587},  {"grid_10x10", kGridCells, kGridIds},
}};

constexpr const FamilyRow& row(TagFamily family) {
  return kFamilies[static_cast<std::size_t>(family)];
}
constexpr std::string_view name(TagFamily family) { return row(family).name; }
constexpr int bits_per_side(TagFamily family) { return row(family).bits; }
constexpr int id_count(TagFamily family) { return row(family).ids; }

/// The inverse of name(); empty for a name that is not in the table.
inline std::optional<TagFamily> family_from_name(std::string_view text) {
  for (std::size_t i = 0; i < kFamilies.size(); ++i)
    if (kFamilies[i].name == text) return static_cast<TagFamily>(i);
  return std::nullopt;
}

/// A tag as printed.
struct TagPattern {
  int id = 0;
  int cells = 0;      ///< along one side of the black square, its black border included
  double size = 0;    ///< edge of the black square, m
  double border = 0;  ///< white margin around it, m
  std::vector<std::uint8_t> white;  ///< cells x cells, row by row from the top left: 1 white

  bool is_white(int row, int column) const {
    return white[static_cast<std::size_t>(row * cells + column)] != 0;
  }
};

/// The tag of this id, `size` (edge of the black square) and `border` (white margin) in m. The id
/// must be one of the family's: 0 to id_count(family) - 1. Uses OpenCV inside, for its tables of
/// bits.
TagPattern tag_pattern(TagFamily family, int id, double size, double border);

/// The id of the family's tag with exactly these cells inside its border, row by row, 1 white,
/// turned any way. There must be bits_per_side(family) squared of them.
std::optional<int> identify_tag(TagFamily family, const std::vector<std::uint8_t>& white);

struct Tag {
  int id = 0;
  std::optional<Eigen::Isometry3d> platform_T_tag;  ///< learned at rest when absent
  /// One standard deviation of platform_T_tag along the tag's own axes: position (m), then a small
  /// rotation (rad). Zero when not known. What tracking feels is the plane: tilt about x and y and
  /// place along z.
  Vector6 sigma = Vector6::Zero();
};

/// The covariance of a tag's motion along axes in which the tag's are the columns of
/// `axes_T_tag`: m, rad.
inline Matrix6 tag_covariance(const Tag& tag, const Eigen::Matrix3d& axes_T_tag) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = axes_T_tag;
  return turn * tag.sigma.cwiseAbs2().asDiagonal() * turn.transpose();
}

/// The inverse: standard deviations along the tag's axes.
inline Vector6 tag_sigma(const Matrix6& covariance, const Eigen::Matrix3d& axes_T_tag) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = axes_T_tag.transpose();
  const Matrix6 own = turn * covariance * turn.transpose();
  return own.diagonal().cwiseMax(0.0).cwiseSqrt();
}

struct TargetDescription {
  TagFamily family = TagFamily::aruco_original;
  double tag_size = 3.8e-3;  ///< edge of the black square, m
  double border = 0.35e-3;   ///< white margin around it, m
  std::vector<Tag> tags = {{5, {}}, {2, {}}};
  /// One standard deviation of the scale of all places together, as a part. Zero when not known.
  double scale_sigma = 0;
};

/// The averaged picture of the sensor at rest, flipped or not as the camera delivers it.
struct ReferenceImage {
  int width = 0;
  int height = 0;
  int frames = 0;            ///< averaged
  std::vector<float> level;  ///< grey levels 0..255, row by row, no padding
};

struct ReferenceOptions {
  int frames = 25;                                       ///< the first frames, taken at rest
  std::optional<Eigen::Isometry3d> camera_T_platform{};  ///< at rest; learned at first when absent
  std::optional<ReferenceImage> appearance{};  ///< as calibrated, seen from camera_T_platform
};

/// What is known of the target at rest so far.
struct KnownReference {
  bool known = false;
  bool given = false;          ///< by the sensor's description, not learned
  bool picture_given = false;  ///< and so was its picture
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> platform_T_tag;  ///< in the target's order
  std::vector<Vector6> tag_sigma;                 ///< as Tag::sigma
  double scale_sigma = 0;                         ///< as TargetDescription's
};

}  // namespace tagwrench
