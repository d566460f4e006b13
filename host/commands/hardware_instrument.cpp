#include "host/commands/hardware_instrument.h"

#include <utility>

#include "host/tools/design/checks.h"
#include "host/tools/design/geometry.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

/// Where a point of the drawing frame is for the camera.
Eigen::Isometry3d camera_from_drawing(const hardware::Geometry& geometry) {
  return Eigen::Isometry3d(Eigen::Translation3d(0, 0, -geometry.pupil));
}

}  // namespace

void take_hardware(const hardware::Parameters& p, study::Instrument& instrument) {
  const hardware::Geometry g = hardware::geometry(p);
  instrument.frame_rate = p.camera.frame_rate;
  const TagFamily family = *family_from_name(p.target.family);
  instrument.origin = {0, 0, p.target.lens_distance};
  Eigen::AlignedBox2d around;
  for (const Eigen::Vector3d& corner : hardware::paper_corners(p, g, Vector6::Zero()))
    around.extend(hardware::seen_at(p, g, corner));
  const Eigen::Isometry3d camera_T_platform =
      camera_from_drawing(g) * Eigen::Translation3d(0, 0, g.platform);
  for (const hardware::TagPlace& tag : g.tags) {
    const TagPattern pattern = tag_pattern(family, tag.id, p.target.tag_size, p.target.border);
    study::SeenTag seen{camera_T_platform * tag.platform_T_tag, pattern.size, pattern.border,
                        pattern.cells, pattern.white};
    if (tag.in_mirror) {
      seen.mirror =
          study::MirrorPlane{g.mirror->normal, g.mirror->distance - g.pupil * g.mirror->normal.z()};
    }
    instrument.tags.push_back(std::move(seen));
  }
  study::SeenPicture& picture = instrument.picture;
  picture.width_px = p.camera.image.width_px;
  picture.height_px = p.camera.image.height_px;
  picture.fx_px = p.camera.image.fx_px;
  picture.fy_px = p.camera.image.fy_px;
  picture.cx_px = p.camera.image.cx_px;
  picture.cy_px = p.camera.image.cy_px;
  study::CountedPixels& counted = instrument.counted;
  counted.frame_width_px = picture.width_px;
  counted.frame_height_px = picture.height_px;
  counted.image_width_px = around.sizes().x();
  counted.image_height_px = around.sizes().y();
  counted.tag_with_border = p.target.tag_size + 2 * p.target.border;
  counted.lens_distance = p.target.lens_distance;
  counted.tag_px = picture.fx_px * counted.tag_with_border / counted.lens_distance;
  study::Spring spring;
  spring.free_length = p.springs.free_length;
  spring.outer_diameter = p.springs.outer_diameter;
  spring.wire = p.springs.wire;
  spring.rate = p.springs.axial;
  for (const Eigen::Vector2d& at : g.springs) {
    spring.top = {at.x(), at.y(), g.spring_attachment};
    instrument.springs.push_back(spring);
  }
  instrument.stiffness = hardware::stiffness(p, g);
  instrument.platform = {p.moving.mass, p.moving.centre, p.moving.inertia};
  instrument.range = hardware::range(p, g).head<3>().minCoeff();
}

}  // namespace tagwrench
