// Frames in, displacement out, on pictures from render.h.
#include "host/tracker/tracker.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include "tests/unit/tracker/render.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

using render::Picture;
using render::Scene;

constexpr int kRestFrames = 25;
constexpr Duration kPeriod = std::chrono::milliseconds(40);

TargetDescription ids(TagFamily family, std::vector<int> list) {
  TargetDescription target;
  target.family = family;
  target.tags.clear();
  for (const int id : list) target.tags.push_back({id, {}, Vector6::Zero()});
  return target;
}

TargetDescription roof_target() { return ids(TagFamily::aruco_original, {5, 2}); }

Vector6 pose6(double x_mm, double y_mm, double z_mm, double rx, double ry, double rz) {
  Vector6 d;
  d << x_mm * 1e-3, y_mm * 1e-3, z_mm * 1e-3, rx, ry, rz;
  return d;
}

/// A tracker, its scene and its clock.
struct Bench {
  Scene scene;
  Tracker tracker;
  std::mt19937 random{7};
  std::uint64_t sequence = 0;

  Bench(Scene the_scene, const TargetDescription& target,
        ReferenceOptions rest = {kRestFrames, {}, {}})
      : scene(std::move(the_scene)), tracker(camera_of(scene), target, rest) {}

  Track show(const Picture& picture) {
    Frame frame;
    frame.image = picture.view();
    frame.sequence = sequence;
    frame.capture_time = TimePoint{} + kPeriod * static_cast<int>(sequence++);
    return tracker.track(frame);
  }
  Track show(const Vector6& displacement) {
    return show(render::take(scene, displacement, random));
  }

  /// Rest frames until learned; the last Track.
  Track rest() {
    const std::vector<float> light = render::expose(scene, Vector6::Zero());
    Track track;
    for (int i = 0; i < kRestFrames; ++i) track = show(render::develop(scene, light, random));
    return track;
  }
};

/// The roof, with placement and reference pose given and no picture.
Bench given_roof() {
  const Scene scene = render::roof();
  TargetDescription target = roof_target();
  for (std::size_t t = 0; t < 2; ++t)
    target.tags[t].platform_T_tag = render::rest_pose(scene).inverse() * scene.tags[t].camera_T_tag;
  return Bench(scene, target, {kRestFrames, render::rest_pose(scene), {}});
}

const Picture& blank() {
  static const Picture grey{640, 480, std::vector<std::uint8_t>(640 * 480, 90)};
  return grey;
}

/// Smooth motion over all six axes: up to 0.6 mm and 40 mrad, below 5 px a frame.
Vector6 sway(int i) {
  const double t = 0.21 * i;
  return pose6(0.6 * std::sin(t), 0.5 * std::sin(1.3 * t), 0.5 * std::sin(0.7 * t),
               0.04 * std::sin(0.9 * t), 0.035 * std::sin(1.1 * t), 0.04 * std::sin(1.7 * t));
}

struct Errors {
  Vector6 rms = Vector6::Zero();
  Vector6 normalised = Vector6::Zero();  // mean of (error / sigma)^2
  int ok = 0;
};

Errors follow(Bench& bench, int frames) {
  Errors errors;
  for (int i = 0; i < frames; ++i) {
    const Vector6 truth = sway(i);
    const Track track = bench.show(truth);
    if (track.status != Status::ok) continue;
    const Vector6 error = track.displacement - truth;
    errors.rms += error.cwiseAbs2();
    errors.normalised += error.cwiseAbs2().cwiseQuotient(track.covariance.diagonal());
    ++errors.ok;
  }
  errors.rms = (errors.rms / std::max(1, errors.ok)).cwiseSqrt();
  errors.normalised /= std::max(1, errors.ok);
  std::printf(
      "rms um %.3f %.3f %.3f mrad %.4f %.4f %.4f  (e/sigma)^2 %.1f %.1f %.1f %.1f %.1f %.1f\n",
      errors.rms[0] * 1e6, errors.rms[1] * 1e6, errors.rms[2] * 1e6, errors.rms[3] * 1e3,
      errors.rms[4] * 1e3, errors.rms[5] * 1e3, errors.normalised[0], errors.normalised[1],
      errors.normalised[2], errors.normalised[3], errors.normalised[4], errors.normalised[5]);
  return errors;
}

void expect_accurate(const Errors& errors, int frames, double xy_um, double z_um,
                     double rotation_mrad) {
  EXPECT_EQ(errors.ok, frames);
  EXPECT_LT(errors.rms[0] * 1e6, xy_um);
  EXPECT_LT(errors.rms[1] * 1e6, xy_um);
  EXPECT_LT(errors.rms[2] * 1e6, z_um);
  for (int i = 3; i < 6; ++i) EXPECT_LT(errors.rms[i] * 1e3, rotation_mrad) << i;
}

TEST(Tracker, FollowsTheRoofInSixAxes) {
  Bench bench(render::roof(), roof_target());
  const Track last = bench.rest();
  EXPECT_EQ(last.diagnostic, Diagnostic::rest_learned);
  expect_accurate(follow(bench, 40), 40, 1.0, 3.0, 0.3);
}

TEST(Tracker, InkSpreadDoesNotChangeTheScale) {
  Scene scene = render::roof();
  for (auto& tag : scene.tags) tag.ink_spread = 25e-6;
  Bench bench(scene, roof_target());
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 1.0, 3.0, 0.3);
}

TEST(Tracker, LensDistortionIsUndone) {
  Scene scene = render::roof();
  scene.k1 = -0.25;
  Bench bench(scene, roof_target());
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 1.0, 3.0, 0.3);
}

TEST(Tracker, MirroredCameraGivesTheSameDisplacement) {
  Scene scene = render::roof();
  scene.mirrored = true;
  Bench bench(scene, roof_target());
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 1.0, 3.0, 0.3);
}

TEST(Tracker, OneTagIsEnough) {
  Bench bench(render::alone(render::tag_five()), ids(TagFamily::aruco_original, {5}));
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 5.0, 15.0, 1.5);
}

TEST(Tracker, AprilTagIsEnough) {
  Bench bench(render::alone(render::april_seven()), ids(TagFamily::apriltag_36h11, {7}));
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 5.0, 15.0, 1.5);
}

TEST(Tracker, GivenPlacementAndRestPoseNeedNoLearning) {
  const Scene scene = render::roof();
  TargetDescription target = roof_target();
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  camera_T_platform.translation() = scene.pivot;
  for (std::size_t t = 0; t < 2; ++t) {
    target.tags[t].platform_T_tag = camera_T_platform.inverse() * scene.tags[t].camera_T_tag;
  }
  Bench bench(scene, target, {kRestFrames, camera_T_platform, {}});
  expect_accurate(follow(bench, 25), 25, 2.0, 6.0, 0.5);
}

TEST(Tracker, ThePictureIsLearnedWhereTheTargetStandsEvenIfRestWasElsewhere) {
  const Scene scene = render::roof();
  TargetDescription target = roof_target();
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  camera_T_platform.translation() = scene.pivot;
  for (std::size_t t = 0; t < 2; ++t) {
    target.tags[t].platform_T_tag = camera_T_platform.inverse() * scene.tags[t].camera_T_tag;
  }
  const Eigen::Vector3d elsewhere(0, 0.8e-3, 0);
  camera_T_platform.translation() += elsewhere;
  Bench bench(scene, target, {kRestFrames, camera_T_platform, {}});
  Track track;
  for (int i = 0; i < 2 * kRestFrames; ++i) track = bench.show(Vector6::Zero());
  ASSERT_EQ(track.status, Status::ok);
  EXPECT_LT((track.displacement.head<3>() + elsewhere).norm(), 10e-6);
  EXPECT_FALSE(track.wanted.empty());  // only alignment with a picture needs but a part
}

TEST(Tracker, GivenPlacementLearnsTheRestPoseAlone) {
  const Scene scene = render::roof();
  TargetDescription target = roof_target();
  // A platform frame of its own, away from the midpoint and turned: displacement is about its
  // origin, camera axes.
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  camera_T_platform.linear() =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.6, 0, 0.8)).toRotationMatrix();
  camera_T_platform.translation() = scene.pivot;
  for (std::size_t t = 0; t < 2; ++t) {
    target.tags[t].platform_T_tag = camera_T_platform.inverse() * scene.tags[t].camera_T_tag;
  }
  Bench bench(scene, target);
  bench.rest();
  expect_accurate(follow(bench, 25), 25, 1.0, 3.0, 0.3);
}

TEST(Tracker, StaysAcquiringWithZeroNumbersUntilRestIsLearned) {
  Bench bench(render::roof(), roof_target());
  const std::vector<float> light = render::expose(bench.scene, Vector6::Zero());
  for (int i = 0; i < kRestFrames; ++i) {
    const Track track = bench.show(render::develop(bench.scene, light, bench.random));
    EXPECT_EQ(track.status, Status::acquiring);
    EXPECT_TRUE(track.displacement.isZero(0));
    EXPECT_EQ(track.diagnostic, i + 1 == kRestFrames ? Diagnostic::rest_learned : Diagnostic::none)
        << i;
  }
  EXPECT_EQ(bench.show(Vector6::Zero()).status, Status::ok);
}

TEST(Tracker, MovingWhileLearningStartsAgain) {
  Bench bench(render::roof(), roof_target());
  for (int i = 0; i < 10; ++i) EXPECT_EQ(bench.show(Vector6::Zero()).diagnostic, Diagnostic::none);
  const Vector6 elsewhere = pose6(0.1, 0, 0, 0, 0, 0);
  EXPECT_EQ(bench.show(elsewhere).diagnostic, Diagnostic::moved_while_learning);
  for (int i = 0; i + 1 < kRestFrames; ++i)
    EXPECT_EQ(bench.show(elsewhere).diagnostic, Diagnostic::none) << i;
  EXPECT_EQ(bench.show(elsewhere).diagnostic, Diagnostic::rest_learned);
}

TEST(Tracker, APlatformThatNeverStandsStillIsLearnedWithItsSwayInTheCovariance) {
  constexpr double kSway_mm = 0.02;  // 0.75 px, twice a second
  Bench bench(render::roof(), roof_target());
  const auto swayed = [&](int i) {
    return pose6(kSway_mm * std::sin(2 * M_PI * 2.0 * i / 25), 0, 0, 0, 0, 0);
  };
  int i = 0;
  Track track;
  while (i < 10 * kRestFrames && track.diagnostic != Diagnostic::rest_learned)
    track = bench.show(swayed(++i));
  ASSERT_EQ(track.diagnostic, Diagnostic::rest_learned);
  EXPECT_GT(i, 2 * kRestFrames) << "not while a still rest may come";
  EXPECT_NEAR(track.details.amount, 1e-3 * kSway_mm / std::sqrt(2), 0.7e-3 * kSway_mm);
  double squares = 0;
  constexpr int kJudged = 50;
  for (int k = 0; k < kJudged; ++k) {
    const Vector6 truth = swayed(++i);
    track = bench.show(truth);
    ASSERT_EQ(track.status, Status::ok);
    squares += std::pow(track.displacement[0] - truth[0], 2) / track.covariance(0, 0);
  }
  EXPECT_LT(squares / kJudged, 1.5);
  EXPECT_LT(std::sqrt(track.covariance(0, 0)), 2e-3 * kSway_mm);
}

TEST(Tracker, MirroredImageIsRecognised) {
  Bench bench(render::roof(), roof_target());
  Scene flipped = bench.scene;
  flipped.mirrored = true;
  int diagnostics = 0;
  for (int i = 0; i < 8; ++i) {
    const Track track = bench.show(render::take(flipped, Vector6::Zero(), bench.random));
    EXPECT_EQ(track.status, Status::acquiring);
    diagnostics += track.diagnostic == Diagnostic::image_looks_mirrored ? 1 : 0;
  }
  EXPECT_GE(diagnostics, 1);
}

TEST(Tracker, UnmirroredImageIsRecognised) {
  Scene scene = render::roof();
  scene.mirrored = true;
  Bench bench(scene, roof_target());
  scene.mirrored = false;
  int diagnostics = 0;
  for (int i = 0; i < 8; ++i) {
    diagnostics += bench.show(render::take(scene, Vector6::Zero(), bench.random)).diagnostic ==
                   Diagnostic::image_looks_unmirrored;
  }
  EXPECT_GE(diagnostics, 1);
}

/// Covers the rows from `top` to `bottom` with one grey.
Picture cover(Picture picture, int top, int bottom, std::uint8_t level) {
  std::fill(picture.pixels.begin() + top * picture.width,
            picture.pixels.begin() + bottom * picture.width, level);
  return picture;
}

TEST(Tracker, OneOfTwoTagsCoveredIsHeldWithLargerSigma) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  const Vector6 truth = pose6(0.1, 0.05, 0, 0, 0, 0.01);
  const Track whole = bench.show(truth);
  ASSERT_EQ(whole.status, Status::ok);
  ASSERT_EQ(whole.tags_held, 2);
  const Track half =
      bench.show(cover(render::take(bench.scene, truth, bench.random), 245, 480, 90));
  ASSERT_EQ(half.status, Status::ok);
  EXPECT_EQ(half.tags_held, 1);
  EXPECT_GT(half.covariance(2, 2), 1.5 * whole.covariance(2, 2));
  EXPECT_LT((half.displacement - truth).head<3>().norm(), 30e-6);
}

TEST(Tracker, BothTagsCoveredIsLostAndComesBack) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  const Vector6 truth = pose6(0.3, -0.2, 0.1, 0.02, 0, -0.03);
  const Track covered =
      bench.show(cover(render::take(bench.scene, truth, bench.random), 0, 480, 90));
  EXPECT_EQ(covered.status, Status::lost);
  EXPECT_TRUE(covered.displacement.isZero(0));
  const Track back = bench.show(truth);
  ASSERT_EQ(back.status, Status::ok);
  EXPECT_LT((back.displacement - truth).head<3>().norm(), 5e-6);
}

TEST(Tracker, HeldAgainWithinTwoFramesAfterItMovedUnseen) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  bench.show(sway(3));
  for (int i = 0; i < 4; ++i) {
    const Track hidden =
        bench.show(cover(render::take(bench.scene, sway(3 + i), bench.random), 0, 480, 90));
    EXPECT_NE(hidden.status, Status::ok);
  }
  const Vector6 elsewhere = pose6(-0.8, 0.6, 0.4, 0.04, -0.03, 0.06);
  bench.show(elsewhere);
  const Track second = bench.show(elsewhere);
  ASSERT_EQ(second.status, Status::ok);
  EXPECT_EQ(second.tags_held, 2);
  EXPECT_LT((second.displacement - elsewhere).head<3>().norm(), 5e-6);
}

TEST(Tracker, FastAndAbruptMotionIsFollowedInTheSameFrame) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  // 0.5 mm is 19 px: to and fro, then stopping dead.
  for (const double x_mm : {0.0, 0.5, 1.0, 1.5, 1.5, 1.0, 0.0, -0.5, -0.5}) {
    const Vector6 truth = pose6(x_mm, 0.5 * x_mm, 0, 0, 0, 0.05 * x_mm);
    const Track track = bench.show(truth);
    ASSERT_EQ(track.status, Status::ok) << x_mm;
    EXPECT_LT((track.displacement - truth).head<3>().norm(), 8e-6) << x_mm;
  }
}

TEST(Tracker, TargetAtTheImageBorderNeverGivesWrongNumbers) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  int ok = 0;
  for (int i = 0; i < 24; ++i) {
    const Vector6 truth = pose6(0.4 * i, 0, 0, 0, 0, 0);
    const Track track = bench.show(truth);
    if (track.status != Status::ok) continue;
    ++ok;
    EXPECT_LT((track.displacement - truth).head<3>().norm(), 40e-6) << i;
  }
  EXPECT_GE(ok, 10);
  EXPECT_LT(ok, 24);
}

TEST(Tracker, StandardDeviationsAreHonest) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  const std::vector<float> light = render::expose(bench.scene, Vector6::Zero());
  Vector6 mean = Vector6::Zero();
  Vector6 squares = Vector6::Zero();
  Vector6 claimed = Vector6::Zero();
  constexpr int kFrames = 120;
  for (int i = 0; i < kFrames; ++i) {
    const Track track = bench.show(render::develop(bench.scene, light, bench.random));
    ASSERT_EQ(track.status, Status::ok);
    mean += track.displacement / kFrames;
    squares += track.displacement.cwiseAbs2() / kFrames;
    claimed += track.covariance.diagonal() / kFrames;
  }
  const Vector6 ratio = (squares - mean.cwiseAbs2()).cwiseQuotient(claimed);
  for (int i = 0; i < 6; ++i) {
    std::printf("axis %d: std %.4g, variance over claimed %.2f\n", i,
                std::sqrt(squares[i] - mean[i] * mean[i]), ratio[i]);
    EXPECT_GT(ratio[i], 0.3) << i;
    EXPECT_LT(ratio[i], 2.5) << i;
  }
}

TEST(Tracker, GarbageGivesNoNumbersAndNoNan) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  std::mt19937 random(3);
  Picture noise{640, 480, std::vector<std::uint8_t>(640 * 480)};
  for (auto& pixel : noise.pixels) pixel = static_cast<std::uint8_t>(random());
  const Picture black{640, 480, std::vector<std::uint8_t>(640 * 480, 0)};
  const Picture white{640, 480, std::vector<std::uint8_t>(640 * 480, 255)};
  const Picture tiny{3, 2, std::vector<std::uint8_t>(6, 128)};
  const Picture none;
  for (const Picture* picture : std::vector<const Picture*>{&noise, &black, &white, &tiny, &none}) {
    const Track track = bench.show(*picture);
    EXPECT_EQ(track.status, Status::lost);
    EXPECT_TRUE(track.displacement.isZero(0));
    EXPECT_TRUE(track.covariance.isZero(0));
    EXPECT_TRUE(std::isfinite(track.residual_px));
  }
  EXPECT_EQ(bench.show(Vector6::Zero()).status, Status::ok);
}

TEST(TrackingState, LearnsIsHeldByPictureLostAndFoundAnew) {
  Bench bench(render::roof(), roof_target());
  EXPECT_EQ(bench.tracker.state(), TrackingState::learning_reference);
  bench.show(blank());
  EXPECT_EQ(bench.tracker.state(), TrackingState::learning_reference);
  bench.rest();
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_picture);
  EXPECT_EQ(bench.show(blank()).status, Status::lost);
  EXPECT_EQ(bench.tracker.state(), TrackingState::lost);
  bench.show(blank());
  EXPECT_EQ(bench.tracker.state(), TrackingState::lost);
  EXPECT_EQ(bench.show(Vector6::Zero()).status, Status::ok);
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_picture);
}

TEST(TrackingState, AGivenReferenceIsSearchedHeldByEdgesAndThenByItsPicture) {
  Bench bench = given_roof();
  EXPECT_EQ(bench.tracker.state(), TrackingState::searching);
  EXPECT_EQ(bench.show(blank()).status, Status::acquiring);
  EXPECT_EQ(bench.tracker.state(), TrackingState::searching);
  bench.show(Vector6::Zero());
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_edges);
  for (int i = 0; i < kRestFrames; ++i) bench.show(Vector6::Zero());
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_picture);
}

TEST(TrackingState, HeldByEdgesItIsLostAndHeldByEdgesAgain) {
  Bench bench = given_roof();
  bench.show(Vector6::Zero());
  EXPECT_EQ(bench.show(blank()).status, Status::lost);
  EXPECT_EQ(bench.tracker.state(), TrackingState::lost);
  bench.show(Vector6::Zero());
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_edges);
}

TEST(TrackingState, AFrameThatCannotBeReadLosesAHeldTargetAndNothingElse) {
  Bench bench = given_roof();
  EXPECT_EQ(bench.show(Picture{}).status, Status::acquiring);
  EXPECT_EQ(bench.tracker.state(), TrackingState::searching);
  bench.show(Vector6::Zero());
  EXPECT_EQ(bench.show(Picture{}).status, Status::lost);
  EXPECT_EQ(bench.tracker.state(), TrackingState::lost);
}

TEST(TrackingState, APartThatIsTooSmallToTellLeavesItAsItIs) {
  Bench bench(render::roof(), roof_target());
  bench.rest();
  const Picture jumped = render::take(bench.scene, pose6(0.8, 0.8, 0, 0, 0, 0), bench.random);
  Frame frame;
  frame.image = jumped.view();
  frame.decoded = {0, 0, 64, 64};
  frame.capture_time = TimePoint{} + kPeriod * static_cast<int>(bench.sequence);
  const Track part = bench.tracker.track(frame);
  EXPECT_TRUE(part.needs_whole_frame);
  EXPECT_EQ(part.status, Status::lost);
  EXPECT_EQ(bench.tracker.state(), TrackingState::held_by_picture);
  frame.decoded = {};
  EXPECT_EQ(bench.tracker.track(frame).status, Status::ok);
}

TEST(Tracker, TinyCameraNeverFindsAnything) {
  CameraModel camera;
  camera.width_px = 3;
  camera.height_px = 2;
  Tracker tracker(camera, roof_target(), {});
  const Picture tiny{3, 2, std::vector<std::uint8_t>(6, 128)};
  Frame frame;
  frame.image = tiny.view();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(tracker.track(frame).status, Status::acquiring);
}

}  // namespace
}  // namespace tagwrench
