// What the target looked like at rest, pixel by pixel: those pixels of the averaged picture that
// tell something about the pose, as points on the tags' planes with all that one step of alignment
// needs, laid out for vector units.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"

namespace tagwrench {

/// I(x + dx, y + dy) for |dx|, |dy| <= 1/2, as a full cubic. Order of the coefficients:
/// 1, dx, dy, dx^2, dx dy, dy^2, dx^3, dx^2 dy, dx dy^2, dy^3.
using PixelPolynomial = std::array<double, 10>;

/// A rectangle of a picture as a smooth function: quintic B-spline interpolation, and the
/// polynomial that describes it best over one pixel. A cubic spline would leave a few thousandths
/// of a pixel at edges that run along the pixels' rows. Coordinates are those of the picture, pixel
/// centres at integers.
class SplineImage {
 public:
  /// `levels`: width * height numbers, row by row; the rectangle's first pixel is (left, top).
  /// Mirror boundary (Unser, "Splines: a perfect fit", IEEE SPM 16(6), 1999).
  SplineImage(std::vector<float> levels, int left, int top, int width, int height);

  /// The interpolated level; at integers, the given one. Outside, the nearest border repeats.
  double level(double x, double y) const;

  /// Least squares over the pixel's area: within a pixel the cubic is closer to the spline than a
  /// Taylor series about its centre.
  PixelPolynomial polynomial(int x, int y) const;

 private:
  double coefficient(int column, int row) const;

  std::vector<float> coefficients_;
  int left_, top_, width_, height_;
};

/// Parameters of the linear model of one patch, in this order: motion of the platform (camera axes,
/// m and rad; see rotation.h), blur (2), illumination of the patch's tag (5). The residual image
/// is explained by
///   motion   gradient times image motion,
///   blur     the Laplacian, times 1 and times depth: a Gaussian point spread whose variance grows
///            by 2 b adds b times the Laplacian (heat equation) and, to second order, b^2 / 2 times
///            the Laplacian of that; defocus changes the variance in proportion to depth,
///   light    gain times (1, x, y, y^2) over the tag's picture, and an offset: y^2 for the bands
///            that a flickering lamp leaves with a rolling shutter. An offset with slopes would
///            cost a fifth of the precision.
constexpr int kMotionParameters = 6;
constexpr int kBlurParameters = 2;
constexpr int kIlluminationParameters = 5;
constexpr int kSharedParameters = kMotionParameters + kBlurParameters;
constexpr int kPatchParameters = kSharedParameters + kIlluminationParameters;

constexpr int kNuisanceParameters = kBlurParameters + kIlluminationParameters;

using PatchVector = Eigen::Matrix<double, kPatchParameters, 1>;
using PatchMatrix = Eigen::Matrix<double, kPatchParameters, kPatchParameters>;

/// Variance of a pixel's noise, grey levels squared: constant + slope * level.
struct PixelNoise {
  double constant = 4.0;
  double slope = 0.0;
  double variance(double level) const;
};

/// Of the depth on which blur depends, m.
constexpr double kDepthUnit = 1e-3;

/// Patches along a tag's side.
constexpr int kPatchesPerSide = 6;

/// Runs of pixels start and end at multiples of this; padding has weight 0.
constexpr std::size_t kRun = 16;

/// One number for each pixel.
using PixelArray = std::vector<float>;

struct PixelPatch {
  std::size_t first = 0;   ///< pixel
  std::size_t count = 0;   ///< multiple of kRun
  std::size_t pixels = 0;  ///< of these, not padding
  std::size_t tag = 0;
  std::size_t row = 0, column = 0;  ///< on the tag, 0..kPatchesPerSide - 1
  double reach_px = 0;              ///< of the pixels from the middle one, along either axis
  double mean_noise = 0;            ///< standard deviation, grey levels
  /// On the tag's plane, platform frame: what the patch's middle pixel shows, and the pixels one to
  /// its right and one below.
  Eigen::Vector3d middle, right, below;
  /// Sums of products of whitened columns: of the gradient (2), from which the motion's follow for
  /// any pose, and of blur and illumination.
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 2, kNuisanceParameters> gradient_nuisance =
      Eigen::Matrix<double, 2, kNuisanceParameters>::Zero();
  Eigen::Matrix<double, kNuisanceParameters, kNuisanceParameters> nuisance =
      Eigen::Matrix<double, kNuisanceParameters, kNuisanceParameters>::Zero();
};

struct PixelTemplate {
  CameraModel camera;  ///< of the raw image: fx is negative in a mirrored one
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();  ///< when it was learned
  int frames = 1;                                                       ///< averaged
  double contrast = 0;  ///< between the darkest and the brightest pixels, grey levels
  std::size_t tags = 0;
  std::vector<PixelPatch> patches;

  PixelArray x, y, z;                ///< platform frame, m
  std::array<PixelArray, 10> level;  ///< PixelPolynomial, grey levels
  PixelArray weight;                 ///< 1 / standard deviation of the noise
  PixelArray depth;                  ///< at rest, from the platform's origin, kDepthUnit
  PixelArray bilaplacian;            ///< Laplacian of the Laplacian, of the smoothed image
  PixelArray across, down;           ///< place on the tag's picture at rest, about -1..1

  std::size_t size() const { return x.size(); }
};

/// The camera of the image as it is delivered, flipped or not.
CameraModel raw_camera(const CameraModel& camera);

struct PixelTemplateOptions {
  std::size_t max_pixels = 10240;
  double min_information = 0.99;  ///< stop choosing pixels when they carry this part
};

/// Chooses the pixels. `mean` is the averaged picture as delivered (not flipped).
/// The planes come from `target`, whose pose at rest is camera_T_platform. Empty patches when
/// nothing is visible.
PixelTemplate make_pixel_template(const CameraModel& camera, const PixelView<float>& mean,
                                  int frames, const PixelNoise& noise,
                                  std::span<const TagPattern> patterns, const EdgeTarget& target,
                                  const Eigen::Isometry3d& camera_T_platform,
                                  const PixelTemplateOptions& options);

}  // namespace tagwrench
