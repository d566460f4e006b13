// What the learner says about the frames at rest and how well it knows what it has learned.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "host/tracker/acquire.h"
#include "host/tracker/reference.h"
#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

constexpr int kFrames = 25;

TEST(Rest, NoiseIsMeasuredWithItsGrowthWithLight) {
  // Grey levels squared, and grey levels.
  constexpr double kConstant = 2.0, kSlope = 0.06, kRounding = 1.0 / 12;
  render::Scene scene = render::roof();
  scene.noise = 0;
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  const CameraModel camera = render::camera_of(scene);
  const TargetDescription target;
  Acquirer acquirer(camera, target);
  ReferenceEstimator learner(camera, target, {kFrames, {}, {}}, acquirer.patterns());
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  ReferenceEstimator::Progress progress = ReferenceEstimator::Progress::waiting;
  for (int i = 0; i < kFrames; ++i) {
    std::vector<float> noisy = light;
    for (float& level : noisy)
      level += static_cast<float>(normal(random) * std::sqrt(kConstant + kSlope * level));
    const render::Picture picture = render::develop(scene, noisy, random);
    const Finding finding = learner.wants_finding() ? acquirer.find(picture.view()) : Finding{};
    progress = learner.add(picture.view(), finding);
  }
  ASSERT_EQ(progress, ReferenceEstimator::Progress::done);
  const PixelNoise& noise = learner.learned().noise;
  EXPECT_NEAR(noise.slope, kSlope, 0.1 * kSlope);
  for (const double level : {30.0, 120.0, 200.0}) {
    const double truth = kConstant + kRounding + kSlope * level;
    EXPECT_NEAR(noise.variance(level), truth, 0.1 * truth) << level;
  }
}

/// A tracker, a roof and their clock.
struct Watched {
  render::Scene scene = render::roof();
  Tracker tracker;
  std::mt19937 random{6};
  int shown = 0;

  explicit Watched(const TargetDescription& target = {},
                   const ReferenceOptions& rest = {kFrames, {}, {}})
      : tracker(render::camera_of(scene), target, rest) {}

  Track show(const std::vector<float>& light) {
    const render::Picture picture = render::develop(scene, light, random);
    Frame frame;
    frame.image = picture.view();
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * shown++;
    return tracker.track(frame);
  }
};

TEST(Rest, PlaceOfThePictureAgainstAGivenRestIsKnownOnlyAsWellAsEdgesTell) {
  TargetDescription target;
  const render::Scene scene = render::roof();
  for (std::size_t t = 0; t < 2; ++t)
    target.tags[t].platform_T_tag = render::rest_pose(scene).inverse() * scene.tags[t].camera_T_tag;
  Watched bench(target, {kFrames, render::rest_pose(scene), {}});
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  Track track;
  for (int i = 0; i < kFrames + 10; ++i) track = bench.show(light);
  ASSERT_EQ(track.status, Status::ok);
  ASSERT_FALSE(track.wanted.empty()) << "by its picture, not by its edges";
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_LT(std::abs(track.displacement[axis]), 4 * std::sqrt(track.covariance(axis, axis)))
        << axis;
  }
  // Edges 0.015 px too far out on a target of 145 px, 21 mm away: 4 um.
  EXPECT_GT(std::sqrt(track.covariance(2, 2)), 2e-6);
  EXPECT_LT(std::sqrt(track.covariance(2, 2)), 10e-6);
}

TEST(Rest, TagsWhosePlanesAreDoubtfulMakeDisplacementsAndNotRestDoubtful) {
  constexpr double kSigma = 100e-6, kAway = 0.5e-3;  // m
  const render::Scene scene = render::roof();
  const Eigen::Isometry3d rest = render::rest_pose(scene);
  TargetDescription target;
  for (std::size_t t = 0; t < 2; ++t) {
    target.tags[t].platform_T_tag = rest.inverse() * scene.tags[t].camera_T_tag;
    target.tags[t].sigma[2] = kSigma;
  }
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  Watched bench(target, {kFrames, rest, ReferenceImage{scene.width, scene.height, kFrames, light}});
  Vector6 away = Vector6::Zero();
  away[0] = kAway;
  const Track at_rest = bench.show(light);
  const Track displaced = bench.show(render::expose(scene, away));
  ASSERT_EQ(at_rest.status, Status::ok);
  ASSERT_EQ(displaced.status, Status::ok);
  EXPECT_LT(std::sqrt(at_rest.covariance(0, 0)), 0.2e-6);
  // The picture tells displacement over distance, which an inclined plane that is off by so much
  // along its normal has by more; two tags together know their distance better.
  const double inclination = std::abs(scene.tags[0].camera_T_tag.linear()(2, 2));
  const double expected = kAway * kSigma / inclination / scene.pivot.z() / std::sqrt(2);
  EXPECT_NEAR(std::sqrt(displaced.covariance(0, 0)), expected, 0.3 * expected);
}

}  // namespace
}  // namespace tagwrench
