#include "host/tracker/tag_corners.h"

#include "host/tracker/projection.h"

namespace tagwrench {

void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept {
  // Top left, top right, bottom right, bottom left: tag axes are x right, y down.
  constexpr double kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  track.corner_count = 0;
  if (platform_T_tag.size() != target.tags.size() || target.tags.size() > track.corners.size())
    return;
  const double half = 0.5 * target.tag_size;
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    TagCorners& out = track.corners[t];
    out.id = target.tags[t].id;
    for (std::size_t c = 0; c < 4; ++c) {
      const Eigen::Vector3d corner(kSigns[c][0] * half, kSigns[c][1] * half, 0);
      const ProjectedPoint at = project(camera, camera_T_platform * (platform_T_tag[t] * corner));
      if (!at.valid) return;
      const double x = at.pixel.x();
      out.px[2 * c] = camera.mirrored ? camera.width_px - 1 - x : x;
      out.px[2 * c + 1] = at.pixel.y();
    }
  }
  track.corner_count = static_cast<std::uint8_t>(target.tags.size());
}

}  // namespace tagwrench
