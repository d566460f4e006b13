#include "host/tracker/appearance_check.h"

#include <cmath>
#include <vector>

#include "host/tracker/projection.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

constexpr double kMinLikeness = 0.7;  // glare over a quarter of a tag leaves more
constexpr double kMinSeen = 0.5;      // of a tag's cells
constexpr double kMinContrast = 4;    // grey levels, standard deviation over the cells

/// Grey level at a pixel of the image after flipping back; empty outside.
std::optional<double> level_at(const ReferenceImage& image, bool mirrored,
                               const Eigen::Vector2d& pixel) {
  if (!(pixel.x() > -0.5 && pixel.x() < image.width - 0.5 && pixel.y() > -0.5 &&
        pixel.y() < image.height - 0.5)) {
    return std::nullopt;
  }
  const auto column = static_cast<int>(std::lround(pixel.x()));
  const auto row = static_cast<int>(std::lround(pixel.y()));
  const int stored = mirrored ? image.width - 1 - column : column;
  return image.level[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(stored)];
}

/// Of the cells within the black frame, which all tags share.
double likeness(const CameraModel& camera, const ReferenceImage& image, const TagPattern& pattern,
                const Eigen::Isometry3d& camera_T_tag) {
  const double cell = pattern.size / pattern.cells;
  Eigen::ArrayXd levels(pattern.cells * pattern.cells);
  Eigen::ArrayXd printed(levels.size());
  Eigen::Index seen = 0;
  for (int row = 1; row < pattern.cells - 1; ++row) {
    for (int column = 1; column < pattern.cells - 1; ++column) {
      const Eigen::Vector3d middle((column + 0.5) * cell - 0.5 * pattern.size,
                                   (row + 0.5) * cell - 0.5 * pattern.size, 0);
      const ProjectedPoint at = project(camera, camera_T_tag * middle);
      const auto level =
          at.valid ? level_at(image, camera.mirrored, at.pixel) : std::optional<double>();
      if (!level) continue;
      levels[seen] = *level;
      printed[seen++] = pattern.is_white(row, column) ? 1 : 0;
    }
  }
  const int inside = pattern.cells - 2;
  if (static_cast<double>(seen) < kMinSeen * inside * inside) return 0;
  const Eigen::ArrayXd a = levels.head(seen) - levels.head(seen).mean();
  const Eigen::ArrayXd b = printed.head(seen) - printed.head(seen).mean();
  if (!(std::sqrt(a.square().mean()) > kMinContrast)) return 0;
  const double size = std::sqrt(a.square().sum() * b.square().sum());
  return size > 0 ? (a * b).sum() / size : 0;
}

}  // namespace

std::optional<AppearanceMismatch> check_appearance(const CameraModel& camera,
                                                   const TargetDescription& target,
                                                   const ReferenceOptions& reference) {
  if (!reference.appearance || !reference.camera_T_platform) return std::nullopt;
  for (const Tag& tag : target.tags) {
    if (!tag.platform_T_tag) continue;
    const double found =
        likeness(camera, *reference.appearance,
                 tag_pattern(target.family, tag.id, target.tag_size, target.border),
                 *reference.camera_T_platform * *tag.platform_T_tag);
    if (!(found >= kMinLikeness)) return AppearanceMismatch{tag.id, found};
  }
  return std::nullopt;
}

}  // namespace tagwrench
