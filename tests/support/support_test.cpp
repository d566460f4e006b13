// The measures and renderers that other tests rely on.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/aruco.hpp>
#include <random>

#include "tests/support/after_fit.h"
#include "tests/support/art_renderer.h"
#include "tests/support/compound_motion.h"
#include "tests/support/plane_fit.h"

namespace tagwrench::test {
namespace {

const Vector6 kAmplitude = (Vector6() << 1e-3, 1e-3, 1e-3, 0.1, 0.1, 0.1).finished();  // m, rad
const Vector6 kNoise = (Vector6() << 1e-6, 2e-6, 3e-6, 1e-4, 2e-4, 3e-4).finished();

struct Sequence {
  std::vector<Vector6> readings, truths;
};

/// Readings with a scale, a crosstalk and an offset, and with noise.
Sequence affine_readings(double noise, int frames) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Sequence sequence;
  for (int i = 0; i < frames; ++i) {
    const Vector6 truth = compound_motion(kAmplitude, i / 25.0);
    Vector6 reading = 1.01 * truth + 0.3 * kNoise;
    reading[0] += 0.02 * truth[2];
    for (int a = 0; a < 6; ++a) reading[a] += noise * kNoise[a] * normal(random);
    sequence.truths.push_back(truth);
    sequence.readings.push_back(reading);
  }
  return sequence;
}

TEST(ErrorAfterFit, TakesUpEveryAffineError) {
  const Sequence s = affine_readings(0, 300);
  const Vector6 error = error_after_fit(s.readings, s.truths);
  EXPECT_LT(error.cwiseQuotient(kNoise).maxCoeff(), 1e-3);
}

TEST(ErrorAfterFit, LeavesTheNoise) {
  const Sequence s = affine_readings(1, 600);
  const Vector6 ratio = error_after_fit(s.readings, s.truths).cwiseQuotient(kNoise);
  EXPECT_GT(ratio.minCoeff(), 0.85);
  EXPECT_LT(ratio.maxCoeff(), 1.15);
}

TEST(ErrorAfterFit, IsNotANumberForTooFewReadings) {
  const Sequence s = affine_readings(1, 40);
  EXPECT_TRUE(std::isnan(error_after_fit(s.readings, s.truths)[0]));
}

TEST(CompoundMotion, StartsAtRestAndStaysWithinItsAmplitude) {
  EXPECT_EQ(compound_motion(kAmplitude, -0.5), Vector6::Zero());
  EXPECT_EQ(compound_motion(kAmplitude, 0), Vector6::Zero());
  Vector6 largest = Vector6::Zero();
  for (int i = 0; i < 500; ++i)
    largest = largest.cwiseMax(compound_motion(kAmplitude, i / 25.0).cwiseAbs());
  EXPECT_LE(largest.cwiseQuotient(kAmplitude).maxCoeff(), 1);
  EXPECT_GT(largest.cwiseQuotient(kAmplitude).minCoeff(), 0.6);
}

TEST(PlaneFit, RecoversThePoseOfARenderedTag) {
  const ArtScene scene;
  const cv::Mat picture = ArtRenderer(scene).picture(Vector6::Zero(), 1);
  Eigen::Matrix3d camera;
  camera << scene.f_px, 0, scene.cx_px, 0, scene.f_px, scene.cy_px, 0, 0, 1;
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL);
  for (const ArtTag& tag : scene.tags) {
    const Eigen::Vector3d r(tag.rotation[0], tag.rotation[1], tag.rotation[2]);
    Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
    truth.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
    for (int a = 0; a < 3; ++a) truth.translation()[a] = tag.position[a] + scene.rest_position[a];
    Eigen::Isometry3d start = truth;
    start.translation() += Eigen::Vector3d(20e-6, -15e-6, 150e-6);
    start.linear() =
        Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, -1, 0.5).normalized()) * start.linear();
    cv::Mat cells;
    cv::aruco::drawMarker(dictionary, tag.id, 7, cells, 1);
    const Eigen::Isometry3d fitted = fit_tag_plane(picture, camera, cells, scene.tag_size, start);
    EXPECT_LT((fitted.translation() - truth.translation()).norm(), 10e-6) << "m, tag " << tag.id;
    EXPECT_LT(Eigen::AngleAxisd(truth.linear().transpose() * fitted.linear()).angle(), 2e-3)
        << "rad, tag " << tag.id;
  }
}

}  // namespace
}  // namespace tagwrench::test
