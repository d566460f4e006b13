// A rendered target at rest (render.h) as the pixel template that the tracker would make of it,
// from the true geometry.
#pragma once

#include <algorithm>
#include <vector>

#include "host/tracker/photometric.h"
#include "host/tracker/pixel_template.h"
#include "host/tracker/target.h"
#include "tests/unit/tracker/render.h"

namespace tagwrench::render {

/// What the tracker is told about the scene's camera.
inline CameraModel camera_of(const Scene& scene) {
  CameraModel camera;
  camera.width_px = scene.width;
  camera.height_px = scene.height;
  camera.fx_px = camera.fy_px = scene.f_px;
  camera.cx_px = scene.cx_px;
  camera.cy_px = scene.cy_px;
  camera.distortion[0] = scene.k1;
  camera.mirrored = scene.mirrored;
  return camera;
}

/// The roof's two tags, placed as they are, in a platform frame at the scene's pivot.
inline EdgeTarget placed(const Scene& scene, const Eigen::Isometry3d& camera_T_platform) {
  EdgeTarget target;
  for (const PrintedTag& tag : scene.tags) {
    EdgeTag placed;
    placed.platform_T_tag = camera_T_platform.inverse() * tag.camera_T_tag;
    target.tags.push_back(placed);
  }
  return target;
}

inline Eigen::Isometry3d rest_pose(const Scene& scene) {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  camera_T_platform.translation() = scene.pivot;
  return camera_T_platform;
}

/// The rest picture as the camera delivers it, averaged until no noise is left.
inline std::vector<float> rest_picture(const Scene& scene) {
  std::vector<float> light = expose(scene, Vector6::Zero());
  if (!scene.mirrored) return light;
  for (auto row = light.begin(); row != light.end(); row += scene.width)
    std::reverse(row, row + scene.width);
  return light;
}

/// `roof` has tags 5 and 2 of aruco_original, in this order. 1,000 frames averaged, with a noise of
/// 2 grey levels each.
inline PixelTemplate template_of(const Scene& roof, const EdgeTarget& target,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const PixelTemplateOptions& options = {}) {
  const std::vector<float> mean = rest_picture(roof);
  const std::vector<TagPattern> patterns = {
      tag_pattern(TagFamily::aruco_original, 5, roof.tags[0].size, roof.tags[0].border),
      tag_pattern(TagFamily::aruco_original, 2, roof.tags[1].size, roof.tags[1].border)};
  return make_pixel_template(camera_of(roof), {mean.data(), roof.width, roof.height, roof.width},
                             1000, PixelNoise{4.0 + 1.0 / 12, 0}, patterns, target,
                             camera_T_platform, options);
}

inline PixelTemplate template_of(const Scene& roof, const PixelTemplateOptions& options = {}) {
  const Eigen::Isometry3d rest = rest_pose(roof);
  return template_of(roof, placed(roof, rest), rest, options);
}

inline PixelWindow window(const Picture& picture) {
  return {picture.pixels.data(), picture.width, 0, 0, picture.width, picture.height};
}

}  // namespace tagwrench::render
