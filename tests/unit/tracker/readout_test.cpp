// A camera that exposes one row after the other, and a target that moves meanwhile.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

constexpr double kReadout = 20e-3;  // s, from the first row to the last

/// Light on rows that are exposed one after the other; `at` is the displacement at a time from the
/// middle of the readout, s. Between a few exposures it is interpolated.
template <class Displacement>
std::vector<float> expose_rows(const render::Scene& scene, const Displacement& at) {
  constexpr int kParts = 8;
  std::vector<std::vector<float>> exposed;
  for (int k = 0; k <= kParts; ++k)
    exposed.push_back(
        render::expose(scene, at(kReadout * (static_cast<double>(k) / kParts - 0.5))));
  std::vector<float> light(exposed.front().size());
  for (int row = 0; row < scene.height; ++row) {
    const float part = static_cast<float>(row) / static_cast<float>(scene.height) * kParts;
    const auto k = static_cast<std::size_t>(part);
    const float more = part - static_cast<float>(k);
    for (int column = 0; column < scene.width; ++column) {
      const auto i = static_cast<std::size_t>(row * scene.width + column);
      light[i] = (1 - more) * exposed[k][i] + more * exposed[k + 1][i];
    }
  }
  return light;
}

void expect_near(const Vector6& truth, const Vector6& is) {
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_LT(std::abs(is[axis] - truth[axis]), axis < 2    ? 0.5e-6
                                                : axis == 2 ? 2e-6
                                                            : 0.3e-3)
        << "axis " << axis;
  }
}

TEST(RollingShutter, PoseIsThatOfTheMiddleRow) {
  const render::Scene scene = render::roof();
  PhotometricAligner aligner;
  aligner.set_template(render::template_of(scene));
  Vector6 velocity;
  velocity << 3e-3, -4e-3, 10e-3, 0.3, 0.3, 0.5;  // m/s, rad/s
  std::mt19937 random(2);
  const render::Picture picture = render::develop(
      scene, expose_rows(scene, [&](double t) { return Vector6(t * velocity); }), random);
  const Eigen::Isometry3d rest = render::rest_pose(scene);
  PhotometricState state;
  const PhotometricFit fit =
      aligner.align(render::window(picture), rest, {kReadout, velocity}, state);
  ASSERT_TRUE(fit.converged);
  expect_near(Vector6::Zero(), motion_between(rest, fit.camera_T_platform));
  EXPECT_LT(fit.residual, 1.4);
}

TEST(RollingShutter, AcceleratedTargetIsFollowed) {
  constexpr double kPeriod = 40e-3;  // s
  constexpr int kRestFrames = 10;
  const render::Scene scene = render::roof();
  CameraModel camera = render::camera_of(scene);
  camera.readout = kReadout;
  Tracker tracker(camera, TargetDescription{}, {kRestFrames, {}, {}});
  std::mt19937 random(3);
  int shown = 0;
  const auto show = [&](const std::vector<float>& light) {
    const render::Picture picture = render::develop(scene, light, random);
    Frame frame;
    frame.image = picture.view();
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * shown++;
    return tracker.track(frame);
  };
  const std::vector<float> still = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < kRestFrames + 2; ++i) show(still);
  Vector6 acceleration;
  acceleration << 0.02, -0.02, 0.03, 0, 0, 1.5;  // m/s^2, rad/s^2
  const auto displacement = [&](double t) { return Vector6(0.5 * t * t * acceleration); };
  for (int i = 1; i <= 5; ++i) {
    const double now = i * kPeriod;
    const Track track = show(expose_rows(scene, [&](double t) { return displacement(now + t); }));
    if (i < 3) continue;  // it does not start when a frame is taken
    ASSERT_EQ(track.status, Status::ok) << i;
    expect_near(displacement(now), track.displacement);
  }
}

}  // namespace
}  // namespace tagwrench
