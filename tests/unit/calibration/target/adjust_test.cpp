// Calibrating the target's geometry on the simulated sensor, which shares no maths with it.
#include <gtest/gtest.h>

#include "host/calibration/target/recorder.h"
#include "host/core/config_error.h"
#include "host/tracker/tracker.h"
#include "tests/unit/calibration/target/target_record.h"

namespace tagwrench {
namespace {

using test::realistic;
using test::Recording;

constexpr double kUm = 1e-6;
constexpr double kMrad = 1e-3;
constexpr int kFrames = 225;

TargetEstimate adjusted(const Recording& recording) {
  return adjust_target(recording.record->at_rest(), recording.record->keyframes());
}

/// By how much the estimate is farther from the lens, as a part.
double scale_error(const Recording& recording, const TargetEstimate& estimate) {
  double ratio = 0;
  for (std::size_t t = 0; t < 2; ++t)
    ratio += 0.5 * estimate.camera_T_tag[t].translation().norm() /
             recording.true_tag(t).translation().norm();
  return ratio - 1;
}

/// Of each tag's place, in its own axes (m, rad), the scale of all taken out.
std::vector<Vector6> shape_errors(const Recording& recording, const TargetEstimate& estimate) {
  const double scale = 1 + scale_error(recording, estimate);
  std::vector<Vector6> out;
  for (std::size_t t = 0; t < 2; ++t) {
    Eigen::Isometry3d seen = estimate.camera_T_tag[t];
    seen.translation() /= scale;
    out.push_back(
        motion_between(Eigen::Isometry3d::Identity(), recording.true_tag(t).inverse() * seen));
  }
  return out;
}

TEST(TargetFromMotion, ThePlanesAreRecoveredAndTheirSigmaIsHonest) {
  double squares = 0;
  int count = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const Recording recording(realistic(seed), kFrames);
    ASSERT_TRUE(recording.record->rest_known());
    check_record(*recording.record, recording.sensor.target, recording.sensor.rest);
    const TargetEstimate estimate = adjusted(recording);
    check_estimate(estimate, recording.sensor.target, recording.sensor.camera);
    const TargetSigmas sigmas = target_sigmas(estimate, recording.sensor.target);
    const std::vector<Vector6> errors = shape_errors(recording, estimate);
    for (std::size_t t = 0; t < 2; ++t) {
      for (const int axis : {2, 3, 4}) {  // the plane: along its normal, and tilt
        EXPECT_LT(std::abs(errors[t][axis]), axis == 2 ? 3 * kUm : 3 * kMrad)
            << "seed " << seed << " tag " << t << " axis " << axis;
        squares += std::pow(errors[t][axis] / sigmas.tag[t][axis], 2);
        ++count;
      }
    }
    EXPECT_LT(std::abs(scale_error(recording, estimate)), 2 * sigmas.scale) << "seed " << seed;
    // Motion adds to what the rest image tells.
    EXPECT_GE(better_known(estimate, 0.9), 2) << "seed " << seed;
  }
  // Mean squared normalised error of 24 numbers, some of them alike.
  EXPECT_GT(squares / count, 0.3);
  EXPECT_LT(squares / count, 2.5);
}

TEST(TargetFromMotion, ARollingShutterIsMeasuredAndSpoilsNothing) {
  sim::Scenario scenario = realistic(6);
  scenario.exposure.rolling_readout = 20e-3;  // s
  const Recording recording(scenario, kFrames);
  const TargetEstimate estimate = adjusted(recording);
  check_estimate(estimate, recording.sensor.target, recording.sensor.camera);
  EXPECT_NEAR(estimate.readout, 20e-3, 4 * estimate.readout_sigma);  // s
  EXPECT_LT(estimate.readout_sigma, 0.5e-3);
  EXPECT_TRUE(readout_is_clear(estimate));
  EXPECT_NEAR(estimate.focal_ratio, 1, 4 * estimate.focal_sigma);
  for (std::size_t t = 0; t < 2; ++t) {
    const Vector6 error = motion_between(recording.true_tag(t), estimate.camera_T_tag[t]);
    EXPECT_LT(error.head<3>().norm(), 10 * kUm) << "tag " << t;
    EXPECT_LT(error.tail<3>().norm(), 2 * kMrad) << "tag " << t;
  }
}

TEST(TargetFromMotion, AGlobalShutterIsNotTakenForARollingOne) {
  const Recording recording(realistic(3), kFrames);
  const TargetEstimate estimate = adjusted(recording);
  EXPECT_NEAR(estimate.readout, 0, 4 * estimate.readout_sigma);
  EXPECT_FALSE(readout_is_clear(estimate));
}

// Errors of the tracker, on all axes, when it is given the tags' places.
class Follower {
 public:
  Follower(const Recording& recording, const Eigen::Isometry3d& platform,
           const std::vector<Eigen::Isometry3d>& camera_T_tag)
      : tracker_(recording.sensor.camera, placed(recording, platform, camera_T_tag),
                 recording.sensor.rest) {}

  void follow(const Frame& frame, const Vector6& truth) {
    const Track track = tracker_.track(frame);
    if (track.status != Status::ok || truth.isZero()) return;
    squares_ += (track.displacement - truth).cwiseAbs2();
    truth_squares_ += truth.cwiseAbs2();
    ++count_;
  }
  Vector6 rms() const { return (squares_ / count_).cwiseSqrt(); }
  Vector6 rms_truth() const { return (truth_squares_ / count_).cwiseSqrt(); }
  int count() const { return count_; }

 private:
  static TargetDescription placed(const Recording& recording, const Eigen::Isometry3d& platform,
                                  const std::vector<Eigen::Isometry3d>& camera_T_tag) {
    TargetDescription target = recording.sensor.target;
    for (std::size_t t = 0; t < target.tags.size(); ++t)
      target.tags[t].platform_T_tag = platform.inverse() * camera_T_tag[t];
    return target;
  }

  Tracker tracker_;
  Vector6 squares_ = Vector6::Zero();
  Vector6 truth_squares_ = Vector6::Zero();
  int count_ = 0;
};

TEST(TargetFromMotion, DisplacementIsAbsoluteAfterwardsButForTheScale) {
  const sim::Scenario scenario = realistic(5);
  const Recording recording(scenario, kFrames);
  const TargetEstimate estimate = adjusted(recording);
  ASSERT_TRUE(estimate.solved);
  Follower calibrated(recording, midpoint_frame(estimate.camera_T_tag), estimate.camera_T_tag);
  const std::vector<Eigen::Isometry3d> truth = {recording.true_tag(0), recording.true_tag(1)};
  Follower told(recording, midpoint_frame(truth), truth);
  SimulatorSource source(scenario, /*live=*/false);
  for (int i = 0; i < kFrames; ++i) {
    Frame frame;
    source.read(frame);
    calibrated.follow(frame, source.truth().displacement);
    told.follow(frame, source.truth().displacement);
  }
  ASSERT_GT(calibrated.count(), 150);
  const Vector6 rms = calibrated.rms();
  // What the scale leaves open, a part of the way.
  const Vector6 scale =
      target_sigmas(estimate, recording.sensor.target).scale * calibrated.rms_truth();
  EXPECT_LT(rms[0], std::hypot(0.5 * kUm, scale[0]));
  EXPECT_LT(rms[1], std::hypot(0.5 * kUm, scale[1]));
  // Along z the tracker's own errors are of this size, even when it is told the truth.
  EXPECT_LT(rms[2], std::hypot(std::max(1.5 * kUm, 1.15 * told.rms()[2]), scale[2]));
}

// What a person is told who recorded badly; empty if nothing is wrong.
std::string complaint(const Recording& recording) {
  try {
    check_record(*recording.record, recording.sensor.target, recording.sensor.rest);
    check_estimate(adjusted(recording), recording.sensor.target, recording.sensor.camera);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

void expect_complaint(const Recording& recording, const std::string& part) {
  const std::string line = complaint(recording);
  EXPECT_NE(line.find(part), std::string::npos) << "no '" << part << "' in: " << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
}

TEST(TargetRefuses, RestAlone) {
  sim::Scenario scenario = realistic(1);
  scenario.trajectory.motion = sim::Motion::rest;
  expect_complaint(Recording(scenario, 15), "do not make a rest of");
  expect_complaint(Recording(scenario, 60), "hardly moved");
}

TEST(TargetRefuses, OneAxisAlone) {
  for (const int axis : {2, 4, 5}) {
    sim::Scenario scenario = realistic(1);
    for (int i = 0; i < 6; ++i) {
      if (i != axis) scenario.trajectory.amplitude[static_cast<std::size_t>(i)] = 1e-6;
    }
    expect_complaint(Recording(scenario, 125),
                     axis == 4 ? "moved in one plane only" : "hardly moved");
  }
}

TEST(TargetRefuses, AFocalLengthThatIsWrongByFivePercent) {
  for (const double ratio : {0.95, 1.05}) {
    const Recording recording(realistic(2), kFrames, ratio);
    expect_complaint(recording, "calibrate camera");
    const TargetEstimate estimate = adjusted(recording);
    EXPECT_NEAR(estimate.focal_ratio, 1 / ratio, 0.01);
    EXPECT_NEAR(estimate.focal_ratio, 1 / ratio, 5 * estimate.focal_sigma);
  }
}

TEST(TargetRefuses, ASingleTag) {
  sim::Scenario scenario = realistic(1);
  scenario.target.tags.pop_back();
  expect_complaint(Recording(scenario, 5), "one tag alone");
}

TEST(TargetRefuses, TagsThatAreHidden) {
  expect_complaint(Recording(realistic(1), 100, 1, 0), "no tag was seen");
  expect_complaint(Recording(realistic(1), 100, 1, 40), "were held in only");
}

TEST(TargetRefuses, AMirroredImageThatSensorYamlDoesNotKnow) {
  sim::Scenario scenario = realistic(1);
  scenario.camera.mirrored = true;
  Recording right(scenario, 1);
  Recording wrong(scenario, 1);
  const CameraModel plain = [&] {
    CameraModel camera = wrong.sensor.camera;
    camera.mirrored = false;
    return camera;
  }();
  wrong.record =
      std::make_unique<TargetRecorder>(plain, wrong.sensor.target, wrong.sensor.rest, 10);
  SimulatorSource source(scenario, /*live=*/false);
  for (int i = 0; i < 10; ++i) {
    Frame frame;
    source.read(frame);
    wrong.record->add(frame);
  }
  expect_complaint(wrong, "mirrored");
}

TEST(ViewSpan, ATiltTurnsTheViewAndATurnAboutTheLensDoesNot) {
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  rest.translation().z() = 20e-3;  // m
  std::vector<Keyframe> frames(1);
  frames[0].displacement[3] = 0.1;  // rad
  EXPECT_NEAR(view_span(frames, rest).widest, 0.1, 1e-3);
  EXPECT_NEAR(view_span(frames, rest).narrowest, 0.0, 1e-9);
  // The platform swings about the lens: what the lens sees turns with it.
  frames[0].displacement << 20e-3 * std::sin(0.1), 0, 20e-3 * (std::cos(0.1) - 1), 0, 0.1, 0;
  EXPECT_NEAR(view_span(frames, rest).widest, 0.0, 1e-9);
  frames[0].displacement << 0, 0, 1e-3, 0, 0, 0.3;
  EXPECT_NEAR(view_span(frames, rest).widest, 0.0, 1e-9);
}

}  // namespace
}  // namespace tagwrench
