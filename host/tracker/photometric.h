// Photometric alignment: from a predicted pose and pixels to the pose at which the image looks most
// like the template, over the six motions of the rigid target, with the light of each tag and the
// blur as nuisances.
//
// Gauss-Newton with the gradients of the template, which never change (compare Baker and Matthews,
// "Lucas-Kanade 20 years on", IJCV 56(3), 2004), carried through the full camera model of points on
// known planes. The normal equations are put together from small sums over patches, so that they
// cost next to nothing at any pose.
#pragma once

#include <array>
#include <vector>

#include "host/tracker/pixel_sums.h"
#include "host/tracker/pixel_template.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// Light and blur are carried from frame to frame: they change slowly.
struct PhotometricState {
  struct Light {
    std::array<double, 4> gain{1, 0, 0, 0};
    double offset = 0;
  };
  std::array<Light, kMaxTags> light{};
  std::array<double, kBlurParameters> blur{};
};

struct PhotometricFit {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  /// Of the motion, camera axes, m and rad: from the noise, and from how the residuals of the
  /// patches disagree.
  Matrix6 covariance = Matrix6::Zero();
  double residual = 0;           ///< RMS of whitened residuals: 1 when nothing but noise is left
  double residual_fraction = 0;  ///< RMS of residuals relative to the template's contrast
  double good = 0;               ///< part of the template's pixels that the fit believes, 0..1
  std::uint8_t tags_held = 0;
  bool converged = false;
};

class PhotometricAligner {
 public:
  /// Allocates; everything else does not.
  void set_template(PixelTemplate pixels);
  const PixelTemplate& pixels() const noexcept { return template_; }
  bool ready() const noexcept { return !template_.patches.empty(); }

  /// Changes `state` only when the fit has converged. `velocity` is the platform's motion per
  /// second (camera axes, m/s and rad/s): with a rolling shutter, rows are exposed at different
  /// times. Never throws, never allocates.
  PhotometricFit align(const PixelWindow& image, const Eigen::Isometry3d& predicted,
                       const Vector6& velocity, PhotometricState& state) noexcept;

  /// The part of the image that align() looks at from this pose, with a margin; empty when it is
  /// out of view.
  Region region(const Eigen::Isometry3d& pose, int margin_px) const noexcept;

  /// What the motion would be if the patches' pixels were seen `shifts` away from where the pose
  /// has them (image px, one for each patch): for the propagation of errors.
  Vector6 motion_of(const Eigen::Isometry3d& pose, std::span<const Eigen::Vector2d> shifts);

 private:
  using SharedVector = Eigen::Matrix<double, kSharedParameters, 1>;
  using SharedMatrix = Eigen::Matrix<double, kSharedParameters, kSharedParameters>;
  using LightVector = Eigen::Matrix<double, kLightParameters, 1>;
  using LightMatrix = Eigen::Matrix<double, kLightParameters, kLightParameters>;
  using Coupling = Eigen::Matrix<double, kSharedParameters, kLightParameters>;

  struct TagSystem {
    LightMatrix light_inverse;
    Coupling coupling;   ///< shared against light
    Coupling eliminate;  ///< coupling times light_inverse
  };
  struct Step {
    bool solved = false;
    double squared_size = 0;  ///< in standard deviations, all shared parameters together
  };

  void view_patches(const Eigen::Isometry3d& pose, const Vector6& velocity,
                    const PhotometricState& state) noexcept;
  double typical_residual() noexcept;
  void judge_patches(double typical, bool near) noexcept;
  bool factorise() noexcept;
  Step step(PhotometricFit& fit, PhotometricState& state) noexcept;
  void conclude(PhotometricFit& fit) const noexcept;

  PixelTemplate template_;
  std::vector<PatchView> views_;
  std::vector<NormalEquations> sums_;
  PixelPairs pairs_;
  std::vector<std::uint8_t> good_;
  std::vector<float> scratch_;
  /// d template pixel / d motion in the middle of each patch, px/m and px/rad.
  std::vector<Eigen::Matrix<double, 2, kMotionParameters>> pixel_motion_;
  std::vector<Eigen::Matrix2d> template_per_image_;
  std::array<TagSystem, kMaxTags> tag_systems_;
  SharedMatrix inverse_ = SharedMatrix::Zero();
};

}  // namespace tagwrench
