// A tag that sits elsewhere than believed: the error that this makes of displacements, found by
// aligning pictures, against what is said about it.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "host/tracker/photometric.h"
#include "host/tracker/rotation.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

struct Misplaced {
  const char* name;
  std::size_t tag;
  int axis;      ///< of the error
  double error;  ///< m or rad
};

class GeometryError : public testing::TestWithParam<Misplaced> {};

TEST_P(GeometryError, IsWhatTheCovarianceSays) {
  const Misplaced& wrong = GetParam();
  render::Scene scene = render::roof();
  scene.noise = 0;
  scene.supersample = 8;
  const Eigen::Isometry3d truth_at_rest = render::rest_pose(scene);
  Vector6 error = Vector6::Zero();
  error[wrong.axis] = wrong.error;

  // The tracker believes in a tag moved by minus the error, and in an origin, the mean of the tags,
  // moved by half of that.
  render::Scene believed = scene;
  believed.tags[wrong.tag].camera_T_tag = moved(scene.tags[wrong.tag].camera_T_tag, -error);
  Eigen::Isometry3d believed_rest = truth_at_rest;
  believed_rest.translation() -= 0.5 * error.head<3>();

  PhotometricAligner right, aligner;
  right.set_template(render::template_of(scene));
  aligner.set_template(
      render::template_of(scene, render::placed(believed, believed_rest), believed_rest));
  std::vector<Matrix6> covariance(2, Matrix6::Zero());
  covariance[wrong.tag](wrong.axis, wrong.axis) = wrong.error * wrong.error;
  GeometryUncertainty geometry;
  geometry.set(aligner, believed_rest, covariance, 0);
  EXPECT_TRUE(geometry.covariance(Vector6::Zero()).isZero(0)) << "at rest nothing is wrong";

  // In these units pictures of whole grey levels leave errors below kRounding.
  constexpr double kRounding = 0.06;
  constexpr double kRelative = 0.3;
  Vector6 unit;
  unit << 1e-6, 1e-6, 2e-6, 1e-3, 1e-3, 1e-3;
  std::mt19937 random(1);
  double largest = 0;
  for (int axis = 0; axis < 6; ++axis) {
    Vector6 displacement = Vector6::Zero();
    displacement[axis] = axis < 3 ? 0.2e-3 : 0.02;
    const render::Picture picture = render::take(scene, displacement, random);
    const auto read = [&](PhotometricAligner& with, const Eigen::Isometry3d& rest) -> Vector6 {
      PhotometricState state;
      const PhotometricFit fit =
          with.align(render::window(picture), moved(rest, displacement), {}, state);
      EXPECT_TRUE(fit.converged);
      return motion_between(rest, fit.camera_T_platform);
    };
    const Vector6 off =
        (read(aligner, believed_rest) - read(right, truth_at_rest)).cwiseQuotient(unit);
    const Matrix6 said = unit.cwiseInverse().asDiagonal() * geometry.covariance(displacement) *
                         unit.cwiseInverse().asDiagonal();
    // One cause: one direction of error, of either sign.
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(said);
    const Vector6 one =
        std::sqrt(std::max(0.0, eigen.eigenvalues()[5])) * eigen.eigenvectors().col(5);
    EXPECT_LT(eigen.eigenvalues()[4], 1e-6 + 1e-3 * eigen.eigenvalues()[5]);
    largest = std::max(largest, one.norm());
    EXPECT_LT(std::min((one - off).norm(), (one + off).norm()), kRelative * one.norm() + kRounding)
        << "axis " << axis << "\nerror " << off.transpose() << "\nsaid  " << one.transpose();
  }
  EXPECT_GT(largest, 5 * kRounding) << "no error to look at";
}

INSTANTIATE_TEST_SUITE_P(All, GeometryError,
                         testing::Values(Misplaced{"NearerByFortyMicrometres", 0, 2, 40e-6},
                                         Misplaced{"TiltedAboutX", 0, 3, 10e-3},
                                         Misplaced{"TiltedAboutY", 1, 4, 15e-3},
                                         Misplaced{"AsideInX", 0, 0, 40e-6},
                                         Misplaced{"NearerInZ", 1, 2, 40e-6}),
                         [](const auto& param) { return std::string(param.param.name); });

TEST(GeometryUncertainty, OfTheScaleGrowsWithTheTranslationAndLeavesTheTurnAlone) {
  const render::Scene scene = render::roof();
  PhotometricAligner aligner;
  aligner.set_template(render::template_of(scene));
  GeometryUncertainty geometry;
  geometry.set(aligner, render::rest_pose(scene), {Matrix6::Zero(), Matrix6::Zero()}, 0.01);
  Vector6 displacement;
  displacement << 1e-3, -2e-3, 0.5e-3, 0.1, 0.05, -0.2;  // m, rad
  Vector6 error = Vector6::Zero();
  error.head<3>() = 0.01 * displacement.head<3>();
  EXPECT_LT((geometry.covariance(displacement) - error * error.transpose()).norm(), 1e-15);  // m^2
}

TEST(GeometryUncertainty, OfTagsThatAreKnownIsNothing) {
  const render::Scene scene = render::roof();
  PhotometricAligner aligner;
  aligner.set_template(render::template_of(scene));
  GeometryUncertainty geometry;
  geometry.set(aligner, render::rest_pose(scene), {Matrix6::Zero(), Matrix6::Zero()}, 0);
  EXPECT_TRUE(geometry.covariance(Vector6::Constant(1e-3)).isZero(0));
}

}  // namespace
}  // namespace tagwrench
