// The real sensor's one picture, set in motion: its two tags' planes move by known displacements.
// Ink, paper, light, blur and JPEG blocks are real; the motion and the truth are by construction.
//
// Each tag's plane is posed by all of its ink or by its four corners: the two disagree by two
// degrees and more, as ink, paper and glue are real and a planar fit to either is a guess. Where a
// tracker must learn the planes from the ink alone, the corners' are a second truth that its own
// learning does not share. A picture of the moved platform looks the real one
// up through the homographies of the two planes, which meet in a ridge between the tags; beyond the
// tags the planes go on, so that all of the picture moves. The light moves with it. The real
// picture is interpolated exactly (by its Fourier transform to four times the resolution, then
// cubically), so its grain is the same in every frame; noise of its own comes to every frame.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::test {

/// What poses the tags' planes in the picture at rest.
enum class TagPlanes : std::uint8_t {
  by_ink,      ///< least squares over all of the tag (plane_fit.h)
  by_corners,  ///< OpenCV's sub-pixel corners and IPPE
};

struct SemiRealOptions {
  TagPlanes planes = TagPlanes::by_ink;
  double f_px = 805;
  double tag_size = 3.8e-3;  ///< m
  double border = 0.35e-3;   ///< m
  std::vector<int> ids = {5, 2};
  double noise_counts = 2;  ///< standard deviation of what is added to every frame
  int jpeg_quality = 0;     ///< of a round trip through JPEG; 0 = none
  double frame_rate = 25;
  Vector6 amplitude =
      (Vector6() << 0.8e-3, 0.8e-3, 0.6e-3, 0.06, 0.06, 0.07).finished();  ///< m, rad
};

/// The file under TAGWRENCH_DATA; empty when the variable is unset or the file is not there.
std::optional<std::filesystem::path> real_picture();

class SemiReal {
 public:
  /// `picture` is mirrored, as its camera made it; frames are not. Throws std::runtime_error if it
  /// does not show both tags.
  SemiReal(const std::filesystem::path& picture, const SemiRealOptions& options);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Of the tags at rest, in the order of the options' ids.
  const std::vector<Eigen::Isometry3d>& camera_T_tag() const { return camera_T_tag_; }

  /// What frame number `frame` shows: rest for 25 frames, then a compound motion; m, rad.
  Vector6 displacement(int frame) const;

  /// 8-bit grey, with noise of its own for every sequence number.
  cv::Mat picture(const Vector6& displacement, std::uint64_t sequence) const;

  /// Grey levels without added noise or rounding, CV_32F.
  cv::Mat light(const Vector6& displacement) const;

  /// sensor.yaml as the owner knows it; with `true_geometry` the tags' and the platform's poses of
  /// the construction.
  std::string sensor_yaml(bool true_geometry) const;

  /// Frames, times, truth and sensor file into an existing folder.
  void write_folder(const std::filesystem::path& folder, int frames) const;

 private:
  void pose_tags(const cv::Mat& picture);
  void find_ridge();
  float sample(double x, double y) const;

  SemiRealOptions options_;
  int width_ = 0, height_ = 0;
  Eigen::Matrix3d camera_;                       ///< K, px
  std::vector<Eigen::Isometry3d> camera_T_tag_;  ///< at rest
  Eigen::Vector3d origin_;                       ///< of the platform in the camera frame, m
  Eigen::Vector3d ridge_;  ///< line in the picture; > 0 on the first tag's side
  cv::Mat fine_;           ///< the picture, finer and with a margin, CV_32F
};

}  // namespace tagwrench::test
