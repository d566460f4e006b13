// Photometric alignment: from a predicted pose and pixels to the pose at which the image looks most
// like the template, over the six motions of the rigid target, with the illumination of each tag
// and the blur as nuisances.
//
// Gauss-Newton with the gradients of the template, which never change (compare Baker and Matthews,
// "Lucas-Kanade 20 years on", IJCV 56(3), 2004), carried through the full camera model of points on
// known planes. The normal equations are put together from small sums over patches, so that they
// cost next to nothing at any pose.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host/tracker/pixel_template.h"
#include "host/tracker/target.h"

namespace tagwrench {

// The inner loop (pixel_sums.cpp): compares an image with the template, pixel by pixel, and sums up
// what Gauss-Newton needs. Vector code for whatever the processor offers, chosen at run time
// (Google Highway).

/// How one patch is seen from the pose of this step.
struct PatchView {
  std::array<float, 9> camera_R_platform{};  ///< row by row
  std::array<float, 3> camera_t_platform{};  ///< m
  /// Displacement in the template per displacement in the image, px/px, row by row.
  std::array<float, 4> template_per_image{1, 0, 0, 1};
  /// gain * (1, across, down, down^2) times the image plus offset is compared with the template.
  std::array<float, 4> gain{1, 0, 0, 0};
  float offset = 0;
  std::array<float, 2> blur{};  ///< b = blur[0] + blur[1] * depth, px^2
};

struct NormalEquations {
  /// Weighted sums of the whitened columns times the whitened residual, in the order of
  /// PatchVector.
  std::array<float, kPatchParameters> rhs{};
  float squares = 0;  ///< weighted, of whitened residuals
  float weights = 0;
  float inside = 0;  ///< pixels that lie in the image and are not saturated
};

/// The part of an 8-bit image that may be read.
struct PixelWindow {
  const std::uint8_t* pixels = nullptr;
  int stride = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< exclusive at right and bottom
};

/// Which image pixel each pixel of the template was last compared with. Once alignment is within a
/// small part of a pixel the pairs stay: a new choice would bring new noise with every step, and
/// the search would never end.
struct PixelPairs {
  explicit PixelPairs(std::size_t count = 0)
      : column(count), row(count), level(count), valid(count) {}
  PixelArray column, row;  ///< px
  PixelArray level;        ///< grey level
  PixelArray valid;        ///< 1 inside the image, else 0
};

/// residual = gain * image + offset - (template, blurred) at the image pixel that is nearest to
/// where the template's pixel is projected; the template's polynomial is evaluated where that image
/// pixel's centre falls. So neither image nor noise is interpolated. Weights are Tukey's biweight
/// of residual * weight * inverse_cut (0: all 1). `views` and `sums` have one entry for each patch,
/// `pairs` one for each pixel; they are kept as they are when `keep` is set.
void sum_patches(const PixelTemplate& pixels, const PixelWindow& image,
                 std::span<const PatchView> views, float inverse_cut, bool keep, PixelPairs& pairs,
                 std::span<NormalEquations> sums) noexcept;

// The steps around it.

/// Carried from frame to frame: illumination and blur change slowly, and a hand stays for a while.
struct PhotometricState {
  struct Illumination {
    std::array<double, 4> gain{1, 0, 0, 0};
    double offset = 0;
  };
  std::array<Illumination, kMaxTags> illumination{};
  /// Of each tag the patches that were no inliers, bit row * kPatchesPerSide + column.
  std::array<std::uint64_t, kMaxTags> left_out{};
  std::array<double, kBlurParameters> blur{};
};

struct PhotometricFit {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  /// Of the motion, camera axes, m and rad: from the noise, and from how the residuals of the
  /// patches disagree.
  Matrix6 covariance = Matrix6::Zero();
  double residual = 0;           ///< RMS of whitened residuals: 1 when nothing but noise is left
  double residual_fraction = 0;  ///< RMS of residuals relative to the template's contrast
  double inlier_fraction = 0;    ///< of the template's pixels, those in accepted patches, 0..1
  std::array<double, kMaxTags> tag_share{};  ///< likewise, of each tag's pixels
  std::uint8_t tags_held = 0;
  bool converged = false;
};

/// Whether numbers may be made of the fit: converged, to enough of the template, sharp and precise.
bool accepted(const PhotometricFit& fit, const PhotometricState& state) noexcept;

/// Rows of a rolling shutter are exposed one after the other while the platform moves.
struct RowMotion {
  double readout = 0;                  ///< from the first row to the last, s; 0: all at once
  Vector6 velocity = Vector6::Zero();  ///< of the platform, camera axes, m/s and rad/s
};

class PhotometricAligner {
 public:
  /// Allocates; everything else does not.
  void set_template(PixelTemplate pixels);
  const PixelTemplate& pixels() const noexcept { return template_; }
  bool ready() const noexcept { return !template_.patches.empty(); }

  /// Changes `state` only when the fit has converged. Never throws, never allocates.
  PhotometricFit align(const PixelWindow& image, const Eigen::Isometry3d& predicted,
                       const RowMotion& rows, PhotometricState& state) noexcept;

  /// The part of the image that align() looks at from this pose, with a margin; empty when it is
  /// out of view.
  Region region(const Eigen::Isometry3d& pose, int margin_px) const noexcept;

  /// What the motion would be if the patches' pixels were seen `shifts` away from where the pose
  /// has them (image px, one for each patch): for the propagation of errors. `only`: as one tag
  /// alone tells it.
  Vector6 motion_of(const Eigen::Isometry3d& pose, std::span<const Eigen::Vector2d> shifts,
                    std::optional<std::size_t> only = {});

 private:
  using SharedVector = Eigen::Matrix<double, kSharedParameters, 1>;
  using SharedMatrix = Eigen::Matrix<double, kSharedParameters, kSharedParameters>;
  using IlluminationVector = Eigen::Matrix<double, kIlluminationParameters, 1>;
  using IlluminationMatrix =
      Eigen::Matrix<double, kIlluminationParameters, kIlluminationParameters>;
  using Coupling = Eigen::Matrix<double, kSharedParameters, kIlluminationParameters>;

  struct TagSystem {
    IlluminationMatrix illumination_inverse;
    Coupling coupling;   ///< shared against illumination
    Coupling eliminate;  ///< coupling times illumination_inverse
  };

  void view_patches(const Eigen::Isometry3d& pose, const RowMotion& rows,
                    const PhotometricState& state) noexcept;
  double typical_residual() noexcept;
  double disputed(double typical) const noexcept;
  bool judge_far(const PhotometricState& state) noexcept;
  void judge_patches(double typical) noexcept;
  bool factorise() noexcept;
  /// The step's size, squared, in standard deviations, all shared parameters together; nothing
  /// where it leads nowhere.
  std::optional<double> step(PhotometricFit& fit, PhotometricState& state) noexcept;
  void conclude(PhotometricFit& fit) const noexcept;

  PixelTemplate template_;
  std::vector<PatchView> views_;
  std::vector<NormalEquations> sums_;
  PixelPairs pairs_;
  std::vector<std::uint8_t> inlier_;
  std::vector<float> scratch_;
  /// d template pixel / d motion in the middle of each patch, px/m and px/rad.
  std::vector<Eigen::Matrix<double, 2, kMotionParameters>> pixel_motion_;
  std::vector<Eigen::Matrix2d> template_per_image_;
  std::array<TagSystem, kMaxTags> tag_systems_;
  SharedMatrix inverse_ = SharedMatrix::Zero();
};

/// geometry_uncertainty.cpp. What it costs not to know exactly where the tags sit: a displacement d
/// is read with an error that grows with d. First-order propagation: error = (sum over axes j of
/// d_j * slope_j) * (error of the tags' poses at rest). The tags' planes turn or shift while what
/// they show in the picture at rest stays where it is.
class GeometryUncertainty {
 public:
  /// `tag_covariance`: of each tag's motion in the platform frame at rest (camera axes; m, rad; see
  /// rotation.h), with the spread of placement as its cause; the platform's origin, the mean of the
  /// tags' centres, moves with their errors. `scale_sigma`: of all distances together, a part.
  /// Differentiates numerically; allocates.
  void set(PhotometricAligner& aligner, const Eigen::Isometry3d& camera_T_platform,
           std::vector<Matrix6> tag_covariance, double scale_sigma);

  /// Of a displacement (m, rad) read from the image, to which each tag contributed this share of
  /// its pixels (all of them alike: as when all are seen). Between all tags and one alone the share
  /// interpolates. No heap.
  Matrix6 covariance(const Vector6& displacement,
                     const std::array<double, kMaxTags>& tag_share) const noexcept;
  /// All tags seen.
  Matrix6 covariance(const Vector6& displacement) const noexcept;

 private:
  /// Of each tag, per axis of displacement; columns: the tag's six errors, each by one standard
  /// deviation along a principal axis.
  using Slopes = std::vector<std::array<Matrix6, 6>>;

  static Matrix6 spread(const Slopes& slopes, const Vector6& displacement) noexcept;

  Slopes slopes_;
  std::vector<Slopes> alone_;  ///< read from one tag alone, for each
  double scale_sigma_ = 0;
};

}  // namespace tagwrench
