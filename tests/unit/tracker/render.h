// Pictures of tags for the tracker's tests: rays from supersampled pixels to the tags' planes. It
// shares no code with the tracker: its own camera, its own bit patterns, and displacement applied
// by its own rotation.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::render {

struct PrintedTag {
  std::vector<std::string> rows;  ///< the black square, '#' black and '.' white, border included
  double size = 3.8e-3;           ///< m
  double border = 0.35e-3;        ///< m
  double ink_spread = 0;          ///< black grows by this on all sides, m
  Eigen::Isometry3d camera_T_tag = Eigen::Isometry3d::Identity();  ///< at rest
};

struct Scene {
  int width = 640;
  int height = 480;
  double f_px = 805;
  double cx_px = 319.5;
  double cy_px = 239.5;
  double k1 = 0;  ///< radial distortion
  bool mirrored = false;
  double blur_px = 1.0;
  double noise = 2.0;  ///< standard deviation, grey levels
  int supersample = 4;
  std::vector<PrintedTag> tags;
  Eigen::Vector3d pivot{0, 0, 0.021};  ///< platform origin at rest, camera axes, m
};

/// Tags 5 and 2 of aruco_original on a roof, each 45 degrees to the camera, imprecisely placed.
Scene roof();

PrintedTag tag_five();     ///< aruco_original 5
PrintedTag tag_two();      ///< aruco_original 2
PrintedTag april_seven();  ///< apriltag_36h11 7

/// One tag, tilted, 21 mm away; the platform's origin is its centre.
Scene alone(const PrintedTag& tag);

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
  ImageView view() const { return {pixels.data(), width, height, width}; }
};

/// Noise-free light, grey levels; exposing the same pose once is enough for many pictures of it.
std::vector<float> expose(const Scene& scene, const Vector6& displacement);
/// Noise, quantisation, and the mirror if there is one.
Picture develop(const Scene& scene, const std::vector<float>& light, std::mt19937& random);

/// The scene after `displacement` (types.h) from rest.
Picture take(const Scene& scene, const Vector6& displacement, std::mt19937& random);

}  // namespace tagwrench::render
