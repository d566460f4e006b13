// Where the tags of the real picture sit, learned at rest and calibrated from motion, against
// truths that the tracker had no hand in: absolute errors, and whether they are as large as
// claimed.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "host/calibration/target/recorder.h"
#include "host/sensor/sensor_config.h"
#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"
#include "tests/support/after_fit.h"
#include "tests/support/semi_real.h"

namespace tagwrench::test {
namespace {

constexpr int kRestFrames = 25;
constexpr int kFrames = 300;       // moving
constexpr int kOtherFrames = 225;  // of the recording that calibrates: they come after those
constexpr double kUm = 1e-6;

struct Case {
  const char* name;
  TagPlanes planes;
};

struct Tracked {
  int ok = 0;
  Vector6 normalised = Vector6::Zero();  ///< mean of (error / sigma)^2
  Vector6 after_fit = Vector6::Zero();   ///< m, rad
};

class SemiRealPlanes : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const auto picture = real_picture();
    if (!picture)
      GTEST_SKIP() << "TAGWRENCH_DATA is not set; it names the folder with the real recordings";
    options_.planes = GetParam().planes;
    options_.jpeg_quality = 85;
    renderer_ = std::make_unique<SemiReal>(*picture, options_);
    sensor_ = parse_sensor(renderer_->sensor_yaml(false), "semi-real");
  }

  /// Calls use(frame, truth, moving) for the rest and `count` frames of motion from number `first`.
  template <class Use>
  void play(int first, int count, const Use& use) const {
    for (int i = 0; i < kRestFrames + count; ++i) {
      const int number = i < kRestFrames ? i : first + i - kRestFrames;
      const Vector6 truth = renderer_->displacement(number);
      const cv::Mat picture = renderer_->picture(truth, static_cast<std::uint64_t>(first + i));
      Frame frame;
      frame.image = {picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)};
      frame.capture_time = frame.latency_origin =
          TimePoint(Duration(std::llround(1e9 * i / options_.frame_rate)));
      frame.sequence = static_cast<std::uint64_t>(i);
      use(frame, truth, i >= kRestFrames);
    }
  }

  Tracked track(const SensorConfig& sensor) const {
    Tracker tracker(sensor.camera, sensor.target, sensor.rest);
    Tracked out;
    std::vector<Vector6> readings, truths;
    play(kRestFrames, kFrames, [&](const Frame& frame, const Vector6& truth, bool moving) {
      const Track track = tracker.track(frame);
      if (!moving || track.status != Status::ok) return;
      ++out.ok;
      const Vector6 error = track.displacement - truth;
      out.normalised += error.cwiseAbs2().cwiseQuotient(track.covariance.diagonal());
      readings.push_back(track.displacement);
      truths.push_back(truth);
    });
    out.normalised /= std::max(1, out.ok);
    out.after_fit = error_after_fit(readings, truths);
    std::printf("ok %d of %d  (error / sigma)^2", out.ok, kFrames);
    for (const double square : out.normalised) std::printf(" %.2f", square);
    std::printf("  after a fit %.3f %.3f %.3f um\n", out.after_fit[0] / kUm, out.after_fit[1] / kUm,
                out.after_fit[2] / kUm);
    return out;
  }

  /// By how much the tags are farther away than they are, as a part.
  double scale_error(const TargetEstimate& estimate) const {
    double ratio = 0;
    for (std::size_t t = 0; t < estimate.camera_T_tag.size(); ++t)
      ratio += estimate.camera_T_tag[t].translation().norm() /
               renderer_->camera_T_tag()[t].translation().norm();
    return ratio / static_cast<double>(estimate.camera_T_tag.size()) - 1;
  }

  SemiRealOptions options_;
  std::unique_ptr<SemiReal> renderer_;
  SensorConfig sensor_;
};

TEST_P(SemiRealPlanes, LearnedAtRestTheyAreAsPoorlyKnownAsStated) {
  const Tracked tracked = track(sensor_);
  EXPECT_GE(tracked.ok, 295);
  for (int axis = 0; axis < 6; ++axis) EXPECT_LT(tracked.normalised[axis], 6) << "axis " << axis;
}

TEST_P(SemiRealPlanes, CalibratedFromMotionTheyAreRightAndTheScaleIsWithinItsSigma) {
  TargetRecorder record(sensor_.camera, sensor_.target, sensor_.rest, 150);
  play(kRestFrames + kFrames, kOtherFrames,
       [&](const Frame& frame, const Vector6&, bool) { record.add(frame); });
  ASSERT_NO_THROW(check_record(record, sensor_.target, sensor_.rest));
  const TargetEstimate estimate = adjust_target(record.at_rest(), record.keyframes());
  ASSERT_NO_THROW(check_estimate(estimate, sensor_.target, sensor_.camera));

  SensorConfig found = sensor_;
  found.target = calibrated_target(sensor_.target, estimate);
  found.rest.camera_T_platform = midpoint_frame(estimate.camera_T_tag);
  found.rest.appearance = record.at_rest().image;
  std::printf("scale off by %.2f %%, claimed %.2f %%\n", 100 * scale_error(estimate),
              100 * found.target.scale_sigma);
  EXPECT_LT(std::abs(scale_error(estimate)), found.target.scale_sigma);
  EXPECT_LT(found.target.scale_sigma, 0.05);

  const Tracked tracked = track(found);
  EXPECT_GE(tracked.ok, 295);
  EXPECT_LT(tracked.after_fit[0], 0.3 * kUm);
  EXPECT_LT(tracked.after_fit[1], 0.3 * kUm);
  EXPECT_LT(tracked.after_fit[2], 0.9 * kUm);
  for (int axis = 0; axis < 6; ++axis) EXPECT_LT(tracked.normalised[axis], 6) << "axis " << axis;
}

INSTANTIATE_TEST_SUITE_P(Truths, SemiRealPlanes,
                         testing::Values(Case{"ByCorners", TagPlanes::by_corners},
                                         Case{"ByInk", TagPlanes::by_ink}),
                         [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace tagwrench::test
