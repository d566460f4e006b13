// A sensor.yaml that promises hardly any white around the tags, or none.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

class NarrowBorder : public testing::TestWithParam<double> {};

TEST_P(NarrowBorder, IsTrackedByTheEdgesInside) {
  const render::Scene scene = render::roof();
  TargetDescription target;
  target.border = GetParam();  // m
  Tracker tracker(render::camera_of(scene), target, ReferenceOptions{});
  std::mt19937 random(4);
  Vector6 displacement = Vector6::Zero();
  int ok = 0;
  for (int i = 0; i < 35; ++i) {
    if (i >= 25) displacement << 20e-6 * (i - 25), -10e-6 * (i - 25), 30e-6 * (i - 25), 0, 0, 0;
    const render::Picture picture = render::take(scene, displacement, random);
    Frame frame;
    frame.image = picture.view();
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * i;
    const Track track = tracker.track(frame);
    if (track.status != Status::ok) continue;
    ++ok;
    EXPECT_LT((track.displacement - displacement).head<2>().norm(), 2e-6);  // m
    EXPECT_LT(std::abs(track.displacement[2] - displacement[2]), 5e-6);     // m
  }
  EXPECT_EQ(ok, 10);
}

INSTANTIATE_TEST_SUITE_P(Metres, NarrowBorder, testing::Values(0.09e-3, 0.03e-3, 0.0));

}  // namespace
}  // namespace tagwrench
