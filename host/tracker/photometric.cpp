#include "host/tracker/photometric.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Tukey's biweight, cut at this many standard deviations, and what it makes of normal errors: the
/// mean weight, the mean of weight times square, and the variance of the estimate relative to least
/// squares (all by numerical integration).
constexpr double kTukey = 6.0;
constexpr double kMeanWeight = 0.9468;
constexpr double kMeanWeightedSquare = 0.8449;
constexpr double kVarianceFactor = 1.0193;

/// A patch is an inlier when its residuals are at most this many times the typical ones and most of
/// its pixels count.
constexpr double kWorstPatch = 3.0;
constexpr float kMinWeights = 0.7F;
constexpr float kMinInside = 0.7F;
/// From this part of the pixels on, patches that were left out are tried again at once.
constexpr double kMostSeen = 0.65;
/// A tag whose residuals are more than this many times those of the best one is covered.
constexpr double kWorstTag = 6.0;
/// A tag is held when this part of its pixels are inliers.
constexpr double kMinTagFraction = 0.35;
/// The typical patch is the one at this rank from below: more than half of them may be covered.
constexpr double kTypicalRank = 0.3;

/// Of the shared parameters, those that a row or column of patches can take up by itself: the
/// translations. Fewer groups than patches would otherwise be blamed for what is common to all.
constexpr double kGroupsFitted = 3;

constexpr int kMaxSteps = 12;
/// Patches that are inliers in one step and outliers in the next would keep a fit from settling:
/// after so many steps they are what they are.
constexpr int kJudgedSteps = 7;
/// Of the inliers' pixels, whose patches would be inliers no more: where it is more the fit has
/// only been kept from changing its mind (a sheared picture, mostly).
constexpr double kMaxDisputed = 0.03;
constexpr int kFirstSteps = 3;  ///< by then residuals have fallen, or never will
/// Squared sizes of steps, in standard deviations, all parameters together. A step shrinks to a few
/// percent of the one before, squared: what one as small as kSmallStep leaves is lost in the noise
/// (0.3 instead changes no error by a thousandth). Below kNearStep residuals tell which patches are
/// inliers; below kKeepStep pairs of pixels stay.
constexpr double kSmallStep = 3;
constexpr double kNearStep = 400;
constexpr double kKeepStep = 1000;

/// How far illumination and blur may stray before the fit is pulled back: standard deviations of
/// gain, its slopes, offset (grey levels), blur (px^2) and its slope (px^2 per kDepthUnit).
constexpr double kGainPrior = 0.5;
constexpr double kGainSlopePrior = 0.2;
constexpr double kOffsetPrior = 30;
constexpr double kBlurPrior = 1.0;
constexpr double kBlurSlopePrior = 0.5;

/// Of a fit that is accepted: the inliers among the template's pixels (chosen, below
/// kMinTagFraction of two tags), the residuals over the contrast (chosen), and the blur beyond
/// which its expansion does not describe it: of 10,000 frames of hard.yaml one far out of focus was
/// accepted 37 um off at 1.2 px^2, none is at 0.8.
constexpr double kMinInlierFraction = 0.3;
constexpr double kMaxResidualFraction = 0.10;
constexpr double kMaxBlur_px2 = 0.8;

/// What residuals leave unexplained beyond noise, over the contrast, that doubles the variance: so
/// that the normalised error squared of simulated targets which smear by 3 to 10 px is 6 to 8.
constexpr double kUnexplained = 0.04;

constexpr double squared(double v) { return v * v; }

/// Mean square of weighted residuals from where a patch is no inlier.
float worst_square(double typical) {
  return static_cast<float>(squared(kWorstPatch * std::max(1.0, typical)));
}

std::uint64_t patch_bit(const PixelPatch& patch) {
  return std::uint64_t{1} << (patch.row * kPatchesPerSide + patch.column);
}

bool fits(const NormalEquations& patch, float worst) {
  return patch.squares < worst * patch.weights && patch.weights > kMinWeights * patch.inside;
}

Eigen::Matrix<double, kIlluminationParameters, 1> illumination_prior() {
  Eigen::Matrix<double, kIlluminationParameters, 1> sigma;
  sigma << kGainPrior, kGainSlopePrior, kGainSlopePrior, kGainSlopePrior, kOffsetPrior;
  return sigma.cwiseAbs2().cwiseInverse();
}

}  // namespace

bool accepted(const PhotometricFit& fit, const PhotometricState& state) noexcept {
  return fit.converged && fit.inlier_fraction >= kMinInlierFraction &&
         fit.residual_fraction < kMaxResidualFraction && std::abs(state.blur[0]) < kMaxBlur_px2 &&
         is_precise(fit.covariance);
}

void PhotometricAligner::set_template(PixelTemplate pixels) {
  template_ = std::move(pixels);
  const std::size_t patches = template_.patches.size();
  views_.assign(patches, {});
  sums_.assign(patches, {});
  pairs_ = PixelPairs(template_.size());
  inlier_.assign(patches, 1);
  scratch_.assign(patches, 0);
  pixel_motion_.assign(patches, Eigen::Matrix<double, 2, kMotionParameters>::Zero());
  template_per_image_.assign(patches, Eigen::Matrix2d::Identity());
}

void PhotometricAligner::view_patches(const Eigen::Isometry3d& pose, const RowMotion& rows,
                                      const PhotometricState& state) noexcept {
  const bool rolling = rows.readout > 0;
  Eigen::Isometry3d at = pose;
  for (std::size_t n = 0; n < views_.size(); ++n) {
    const PixelPatch& patch = template_.patches[n];
    if (rolling) {
      const double row = project(template_.camera, pose * patch.middle).pixel.y();
      const double delay = rows.readout * (row / template_.camera.height_px - 0.5);
      at = moved(pose, delay * rows.velocity);
    }
    PatchView& view = views_[n];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        view.camera_R_platform[static_cast<std::size_t>(3 * r + c)] =
            static_cast<float>(at.linear()(r, c));
      view.camera_t_platform[static_cast<std::size_t>(r)] = static_cast<float>(at.translation()[r]);
    }
    const PhotometricState::Illumination& illumination = state.illumination[patch.tag];
    for (std::size_t k = 0; k < 4; ++k) view.gain[k] = static_cast<float>(illumination.gain[k]);
    view.offset = static_cast<float>(illumination.offset);
    for (std::size_t k = 0; k < 2; ++k) view.blur[k] = static_cast<float>(state.blur[k]);

    const ProjectedPoint seen = project(template_.camera, at * patch.middle);
    Eigen::Matrix2d image_per_template;
    image_per_template << seen.jacobian * (at.linear() * (patch.right - patch.middle)),
        seen.jacobian * (at.linear() * (patch.below - patch.middle));
    const double area = image_per_template.determinant();
    const bool sensible = area > 0.1 && area < 10;
    const Eigen::Matrix2d back =
        sensible ? Eigen::Matrix2d(image_per_template.inverse()) : Eigen::Matrix2d::Identity();
    template_per_image_[n] = back;
    view.template_per_image = {static_cast<float>(back(0, 0)), static_cast<float>(back(0, 1)),
                               static_cast<float>(back(1, 0)), static_cast<float>(back(1, 1))};
    const Eigen::Vector3d lever = at.linear() * patch.middle;
    pixel_motion_[n].leftCols<3>() = back * seen.jacobian;
    pixel_motion_[n].rightCols<3>() = -pixel_motion_[n].leftCols<3>() * cross_matrix(lever);
  }
}

/// RMS of whitened residuals in a patch that is as it should be; 0 when none is in view.
double PhotometricAligner::typical_residual() noexcept {
  std::size_t count = 0;
  for (std::size_t n = 0; n < sums_.size(); ++n)
    if (sums_[n].inside >= kMinInside * static_cast<float>(template_.patches[n].pixels))
      scratch_[count++] = sums_[n].squares / std::max(1.0F, sums_[n].weights);
  if (count == 0) return 0;
  const auto at =
      scratch_.begin() + static_cast<std::ptrdiff_t>(kTypicalRank * static_cast<double>(count - 1));
  std::nth_element(scratch_.begin(), at, scratch_.begin() + static_cast<std::ptrdiff_t>(count));
  return std::sqrt(static_cast<double>(*at));
}

/// Of the inliers' pixels, those whose patch would be one no more.
double PhotometricAligner::disputed(double typical) const noexcept {
  const float worst = worst_square(typical);
  double all = 0, against = 0;
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    if (inlier_[n] == 0) continue;
    const auto pixels = static_cast<double>(template_.patches[n].pixels);
    all += pixels;
    if (!fits(sums_[n], worst)) against += pixels;
  }
  return all > 0 ? against / all : 1;
}

/// Far from the pose all residuals are large, and tell of whole tags only: one that looks much
/// worse than the best would pull the fit away, and so would patches that were covered in the last
/// frame. True when other patches are inliers than before.
bool PhotometricAligner::judge_far(const PhotometricState& state) noexcept {
  std::array<double, kMaxTags> squares{};
  std::array<double, kMaxTags> weights{};
  const auto candidate = [&](std::size_t n) {
    const PixelPatch& patch = template_.patches[n];
    return sums_[n].inside >= kMinInside * static_cast<float>(patch.pixels) &&
           (state.left_out[patch.tag] & patch_bit(patch)) == 0;
  };
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    if (!candidate(n)) continue;
    squares[template_.patches[n].tag] += sums_[n].squares;
    weights[template_.patches[n].tag] += sums_[n].weights;
  }
  std::array<double, kMaxTags> mean{};
  double best = 1e30;
  for (std::size_t t = 0; t < template_.tags; ++t) {
    if (!(weights[t] > 0)) continue;
    mean[t] = squares[t] / weights[t];
    best = std::min(best, mean[t]);
  }
  bool changed = false;
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    const bool inlier = candidate(n) && mean[template_.patches[n].tag] <= squared(kWorstTag) * best;
    changed = changed || inlier != (inlier_[n] != 0);
    inlier_[n] = inlier ? 1 : 0;
  }
  return changed;
}

/// A covered or dazzled patch is left out, and so is a tag of which little is left.
void PhotometricAligner::judge_patches(double typical) noexcept {
  const float worst = worst_square(typical);
  std::array<double, kMaxTags> all{};
  std::array<double, kMaxTags> accepted{};
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    const NormalEquations& s = sums_[n];
    const PixelPatch& patch = template_.patches[n];
    const bool inlier = s.inside >= kMinInside * static_cast<float>(patch.pixels) && fits(s, worst);
    inlier_[n] = inlier ? 1 : 0;
    all[patch.tag] += static_cast<double>(patch.pixels);
    if (inlier) accepted[patch.tag] += static_cast<double>(patch.pixels);
  }
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    const std::size_t tag = template_.patches[n].tag;
    if (accepted[tag] < kMinTagFraction * all[tag]) inlier_[n] = 0;
  }
}

/// The normal equations of the inliers at the pose and with the weights of the last look,
/// illumination eliminated tag by tag. False when they do not determine the motion.
bool PhotometricAligner::factorise() noexcept {
  std::array<PatchMatrix, kMaxTags> sums;
  for (std::size_t t = 0; t < template_.tags; ++t) sums[t].setZero();
  for (std::size_t n = 0; n < inlier_.size(); ++n) {
    if (inlier_[n] == 0) continue;
    const PixelPatch& patch = template_.patches[n];
    const double weight = sums_[n].weights / static_cast<double>(patch.pixels);
    const Eigen::Matrix<double, 2, kMotionParameters>& motion = pixel_motion_[n];
    PatchMatrix& sum = sums[patch.tag];
    sum.topLeftCorner<kMotionParameters, kMotionParameters>() +=
        weight * (motion.transpose() * patch.gradient * motion);
    sum.topRightCorner<kMotionParameters, kNuisanceParameters>() +=
        weight * (motion.transpose() * patch.gradient_nuisance);
    sum.bottomRightCorner<kNuisanceParameters, kNuisanceParameters>() += weight * patch.nuisance;
  }
  SharedMatrix shared = SharedMatrix::Zero();
  shared(6, 6) = 1 / squared(kBlurPrior);
  shared(7, 7) = 1 / squared(kBlurSlopePrior);
  for (std::size_t t = 0; t < template_.tags; ++t) {
    PatchMatrix& all = sums[t];
    all.bottomLeftCorner<kNuisanceParameters, kMotionParameters>() =
        all.topRightCorner<kMotionParameters, kNuisanceParameters>().transpose();
    TagSystem& tag = tag_systems_[t];
    IlluminationMatrix illumination =
        all.bottomRightCorner<kIlluminationParameters, kIlluminationParameters>();
    illumination.diagonal() += illumination_prior();
    tag.illumination_inverse = Ldlt<kIlluminationParameters>(illumination).inverse();
    tag.coupling = all.topRightCorner<kSharedParameters, kIlluminationParameters>();
    tag.eliminate = tag.coupling * tag.illumination_inverse;
    shared += all.topLeftCorner<kSharedParameters, kSharedParameters>() -
              tag.eliminate * tag.coupling.transpose();
  }
  SharedVector unit;  // metres and radians to like size
  unit << 1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.05, 1, 1;
  const SharedMatrix scaled = unit.asDiagonal() * shared * unit.asDiagonal();
  const Ldlt<kSharedParameters> ldlt(scaled);
  if (!ldlt.positive(1e-12)) return false;
  inverse_ = unit.asDiagonal() * ldlt.inverse() * unit.asDiagonal();
  return inverse_.allFinite();
}

std::optional<double> PhotometricAligner::step(PhotometricFit& fit,
                                               PhotometricState& state) noexcept {
  std::array<PatchVector, kMaxTags> rhs;
  for (std::size_t t = 0; t < template_.tags; ++t) rhs[t].setZero();
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    if (inlier_[n] == 0) continue;
    rhs[template_.patches[n].tag] +=
        Eigen::Map<const Eigen::Matrix<float, kPatchParameters, 1>>(sums_[n].rhs.data())
            .cast<double>();
  }
  SharedVector shared = SharedVector::Zero();
  shared[6] = -state.blur[0] / squared(kBlurPrior);
  shared[7] = -state.blur[1] / squared(kBlurSlopePrior);
  for (std::size_t t = 0; t < template_.tags; ++t) {
    const PhotometricState::Illumination& illumination = state.illumination[t];
    IlluminationVector stray;
    stray << illumination.gain[0] - 1, illumination.gain[1], illumination.gain[2],
        illumination.gain[3], illumination.offset;
    rhs[t].tail<kIlluminationParameters>() += illumination_prior().cwiseProduct(stray);
    shared += rhs[t].head<kSharedParameters>() -
              tag_systems_[t].eliminate * rhs[t].tail<kIlluminationParameters>();
  }
  const SharedVector delta = inverse_ * shared;
  if (!delta.allFinite()) return {};
  for (std::size_t t = 0; t < template_.tags; ++t) {
    // Light acts on the image here, and in the equations on the template: hence the sign.
    const IlluminationVector illumination =
        tag_systems_[t].illumination_inverse *
        (rhs[t].tail<kIlluminationParameters>() - tag_systems_[t].coupling.transpose() * delta);
    for (int k = 0; k < 4; ++k)
      state.illumination[t].gain[static_cast<std::size_t>(k)] -= illumination[k];
    state.illumination[t].offset -= illumination[4];
  }
  state.blur[0] += delta[6];
  state.blur[1] += delta[7];
  // The template moved by delta would look like the image: the platform has moved the other way.
  fit.camera_T_platform = moved(fit.camera_T_platform, -delta.head<6>());
  if (!fit.camera_T_platform.matrix().allFinite()) return {};
  return shared.dot(delta);
}

PhotometricFit PhotometricAligner::align(const PixelWindow& image,
                                         const Eigen::Isometry3d& predicted, const RowMotion& rows,
                                         PhotometricState& state) noexcept {
  PhotometricFit fit;
  fit.camera_T_platform = predicted;
  if (!ready()) return fit;
  PhotometricState now = state;
  float inverse_cut = 0;
  double step_size = 1e30;
  double first_typical = 0;
  bool near = false;  // once patches are judged they stay so: taking them back would begin anew
  for (int i = 0; i < kMaxSteps; ++i) {
    view_patches(fit.camera_T_platform, rows, now);
    sum_patches(template_, image, views_, inverse_cut, step_size < kKeepStep, pairs_, sums_);
    const double typical = typical_residual();
    if (!(typical > 0)) return fit;
    if (i == 0) first_typical = typical;
    if (i >= kFirstSteps && typical > first_typical) return fit;  // running away
    // Far away a step need not be exact: the matrix of the first look serves all that follow with
    // the same patches.
    bool new_matrix = near || i == 0;
    if (!near)
      new_matrix = judge_far(state) || new_matrix;
    else if (i < kJudgedSteps)
      judge_patches(typical);
    if (new_matrix && !factorise()) return fit;
    const std::optional<double> taken = step(fit, now);
    if (!taken) return fit;
    const double scale = std::max(1.0, typical);
    // In standard deviations as the residuals have them.
    step_size = *taken / squared(scale);
    inverse_cut = static_cast<float>(1.0 / (kTukey * scale));
    if (near && step_size < kSmallStep) {
      fit.converged = i < kJudgedSteps || disputed(typical) < kMaxDisputed;
      break;
    }
    near = near || step_size < kNearStep;
  }
  if (!fit.converged) return fit;
  now.left_out.fill(0);
  for (std::size_t n = 0; n < inlier_.size(); ++n) {
    const PixelPatch& patch = template_.patches[n];
    if (inlier_[n] == 0) now.left_out[patch.tag] |= patch_bit(patch);
  }
  state = now;
  renormalise(fit.camera_T_platform);
  conclude(fit);
  // Where most is seen, what is covered cannot pull far, and may be tried again.
  if (fit.inlier_fraction > kMostSeen) state.left_out.fill(0);
  return fit;
}

/// Covariance and quality from the last look.
///
/// White noise would give variance * inverse. Residuals that are alike over a patch (unmodelled
/// texture, illumination, blur) move the fit more: each patch's pull on the motion is added up as
/// the sandwich estimator for clustered errors does (Liang and Zeger, Biometrika 73(1), 1986), and
/// the covariance grows by the mean ratio, which is far less noisy than the sandwich itself.
void PhotometricAligner::conclude(PhotometricFit& fit) const noexcept {
  double squares = 0, inside = 0, all = 0, inliers = 0, noise = 0;
  std::array<bool, kMaxTags> held{};
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    const PixelPatch& patch = template_.patches[n];
    all += static_cast<double>(patch.pixels);
    if (inlier_[n] == 0) continue;
    inliers += static_cast<double>(patch.pixels);
    squares += sums_[n].squares;
    inside += sums_[n].inside;
    noise += patch.mean_noise * sums_[n].inside;
    held[patch.tag] = true;
    fit.tag_share[patch.tag] += static_cast<double>(patch.pixels);
  }
  std::array<double, kMaxTags> pixels{};
  for (const PixelPatch& patch : template_.patches)
    pixels[patch.tag] += static_cast<double>(patch.pixels);
  for (std::size_t t = 0; t < template_.tags; ++t)
    if (pixels[t] > 0) fit.tag_share[t] /= pixels[t];
  fit.inlier_fraction = inliers / all;
  fit.residual = std::sqrt(squares / inside / kMeanWeightedSquare);
  fit.residual_fraction = fit.residual * (noise / inside) / template_.contrast;
  for (const bool h : held) fit.tags_held = static_cast<std::uint8_t>(fit.tags_held + (h ? 1 : 0));

  const double variance = std::max(1.0, squared(fit.residual)) * (1.0 + 1.0 / template_.frames);
  // inverse_ is of the weighted equations.
  const Matrix6 white = variance * kVarianceFactor * kMeanWeight * inverse_.topLeftCorner<6, 6>();
  const Matrix6 information = inverse(white);
  // An edge runs through a row or a column of patches, and with it what is wrong with it.
  struct Groups {
    std::array<std::array<Vector6, kPatchesPerSide>, kMaxTags> pull;
    double ratio = 0;
    double count = 0;
  };
  Groups rows, columns;
  for (Groups* groups : {&rows, &columns})
    for (auto& tag : groups->pull) tag.fill(Vector6::Zero());
  double ratio = 0;
  double patches = 0;
  for (std::size_t n = 0; n < sums_.size(); ++n) {
    if (inlier_[n] == 0) continue;
    const PixelPatch& patch = template_.patches[n];
    const PatchVector rhs =
        Eigen::Map<const Eigen::Matrix<float, kPatchParameters, 1>>(sums_[n].rhs.data())
            .cast<double>();
    const TagSystem& tag = tag_systems_[patch.tag];
    const Vector6 pull =
        inverse_.topRows<6>() *
        (rhs.head<kSharedParameters>() - tag.eliminate * rhs.tail<kIlluminationParameters>());
    ratio += pull.dot(information * pull) / 6.0;
    ++patches;
    rows.pull[patch.tag][patch.row] += pull;
    columns.pull[patch.tag][patch.column] += pull;
  }
  // The fit has taken its own part out of the residuals.
  constexpr double kFitted = kSharedParameters;
  if (patches > kFitted + 3) {
    // And a variance known from so few makes the error Student's t, which spreads wider: most where
    // one tag is covered.
    ratio *= patches / (patches - kFitted - 2);
  }
  for (Groups* groups : {&rows, &columns}) {
    for (const auto& tag : groups->pull) {
      for (const Vector6& pull : tag) {
        if (pull.isZero(0)) continue;
        groups->ratio += pull.dot(information * pull) / 6.0;
        ++groups->count;
      }
    }
    // Few groups leave little to compare: then the patches must do.
    if (groups->count < 1.2 * kFitted) continue;
    const double freedom = groups->count - kGroupsFitted;
    const double excess = groups->ratio * groups->count / freedom - 1;
    // Student's t once more.
    ratio = std::max(ratio, 1 + excess * freedom / (freedom - 2));
  }
  // What all patches have in common, as the smear of a motion, no comparison of them shows; it
  // grows with what the template does not explain beyond noise.
  const double unexplained =
      fit.residual_fraction * std::sqrt(std::max(0.0, 1 - 1 / squared(fit.residual)));
  fit.covariance = std::max(1.0, ratio) * (1 + squared(unexplained / kUnexplained)) * white;
  if (!fit.covariance.allFinite()) fit.converged = false;
}

Region PhotometricAligner::region(const Eigen::Isometry3d& pose, int margin_px) const noexcept {
  Eigen::AlignedBox2d seen;
  for (const PixelPatch& patch : template_.patches) {
    const ProjectedPoint p = project(template_.camera, pose * patch.middle);
    if (!p.valid || !p.pixel.allFinite()) return {};
    const Eigen::Vector2d reach = Eigen::Vector2d::Constant(patch.reach_px);
    seen.extend(p.pixel - reach).extend(p.pixel + reach);
  }
  const Eigen::Array2d image(template_.camera.width_px, template_.camera.height_px);
  const Eigen::Array2d first = (seen.min().array().floor() - margin_px).max(0.0).min(image);
  const Eigen::Array2d past = (seen.max().array().ceil() + margin_px + 1).max(0.0).min(image);
  const int x = static_cast<int>(first.x());
  const int y = static_cast<int>(first.y());
  return {x, y, static_cast<int>(past.x()) - x, static_cast<int>(past.y()) - y};
}

Vector6 PhotometricAligner::motion_of(const Eigen::Isometry3d& pose,
                                      std::span<const Eigen::Vector2d> shifts,
                                      std::optional<std::size_t> only) {
  view_patches(pose, {}, {});
  Matrix6 normal = Matrix6::Zero();
  Vector6 rhs = Vector6::Zero();
  for (std::size_t n = 0; n < template_.patches.size(); ++n) {
    if (only && template_.patches[n].tag != *only) continue;
    const Eigen::Matrix2d& gradient = template_.patches[n].gradient;
    const Eigen::Vector2d shift = template_per_image_[n] * shifts[n];
    normal += pixel_motion_[n].transpose() * gradient * pixel_motion_[n];
    rhs += pixel_motion_[n].transpose() * gradient * shift;
  }
  Vector6 unit;
  unit << 1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.05;
  const Matrix6 scaled = unit.asDiagonal() * normal * unit.asDiagonal();
  return unit.asDiagonal() * Ldlt<6>(scaled).solve(unit.asDiagonal() * rhs);
}

}  // namespace tagwrench
