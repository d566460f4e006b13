// A second renderer, written against the file formats alone: it shares no code with the simulator
// and none with the tracker, so that what holds on both leans on neither.
//
// The tags are OpenCV's own drawings on white paper, as high-resolution art, before a textured
// plate; a picture looks them up through plain homographies, 4 x 4 samples a pixel, blurs the
// samples (Gaussian) and averages them over the pixel's area. Then uneven light, noise, rounding.
// No dynamics: a frame shows the platform standing at its displacement.
#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::test {

struct ArtTag {
  int id = 0;
  cv::Vec3d position{0, 0, 0};  ///< platform_T_tag, m
  cv::Vec3d rotation{0, 0, 0};  ///< rotation vector, rad
};

struct ArtScene {
  int width = 640;
  int height = 480;
  double f_px = 700;
  double cx_px = 319.5;
  double cy_px = 239.5;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3, OpenCV's model
  double tag_size = 3.8e-3;            ///< m; ArUco original
  double border = 0.35e-3;             ///< m
  /// A roof as in the paper, glued by an unsteady hand; the centres' midpoint is the origin.
  std::vector<ArtTag> tags = {{5, {0.04e-3, -1.71e-3, 0.03e-3}, {-0.770, 0.014, -0.011}},
                              {2, {-0.04e-3, 1.71e-3, -0.03e-3}, {0.802, -0.009, 0.016}}};
  cv::Vec3d rest_position{0.1e-3, -0.05e-3, 21e-3};  ///< of the platform in the camera frame, m
  double blur_sigma_px = 1.0;
  double paper_counts = 205, ink_counts = 45, plate_counts = 110;
  double light_fall = 0.15;  ///< share of light lost from the left edge to the right
  double noise_counts = 2;   ///< standard deviation
  double frame_rate = 25;
  Vector6 amplitude =
      (Vector6() << 0.8e-3, 0.8e-3, 0.7e-3, 0.06, 0.06, 0.07).finished();  ///< m, rad
};

class ArtRenderer {
 public:
  explicit ArtRenderer(const ArtScene& scene);

  /// Grey levels without noise or rounding (CV_32F) at a displacement from rest (m, rad).
  cv::Mat light(const Vector6& displacement) const;

  /// The same as a camera delivers it: noise of its own for every sequence number, 8 bit.
  cv::Mat picture(const Vector6& displacement, std::uint64_t sequence) const;

  /// Where a point of a tag's plane (tag axes, m) lies in the image, px.
  cv::Point2d project(const ArtTag& tag, const cv::Point2d& point,
                      const Vector6& displacement) const;

 private:
  struct Art {
    cv::Mat ink_and_paper;  ///< CV_32FC2: light times coverage, and coverage
    double texels_per_m = 0;
  };

  cv::Matx33d ray_from_plane(const ArtTag& tag, const Vector6& displacement) const;
  cv::Mat plate(const cv::Mat& rays, const Vector6& displacement) const;
  void draw_tag(std::size_t tag, const Vector6& displacement, const cv::Mat& rays,
                cv::Mat& scene) const;
  cv::Rect seen(const Vector6& displacement) const;  ///< of the tags, px

  ArtScene scene_;
  std::vector<Art> art_;
  cv::Mat plate_;
  cv::Mat rays_;       ///< CV_32FC2, of every pixel
  cv::Mat fine_rays_;  ///< CV_32FC2, of every sample
};

/// The displacement that frame number `frame` shows: at rest for the first 25 frames, then a
/// compound motion.
Vector6 art_displacement(const ArtScene& scene, int frame);

/// sensor.yaml as the owner knows it; with `true_geometry` also where tags and platform are.
std::string art_sensor_yaml(const ArtScene& scene, bool true_geometry);

/// Frames as PNG, frames.csv, sensor.yaml and truth.csv (wrenches are zero) into an existing
/// folder. Throws std::runtime_error if a file cannot be written.
void write_art_folder(const ArtScene& scene, const std::filesystem::path& folder, int frames,
                      bool true_geometry = false);

}  // namespace tagwrench::test
