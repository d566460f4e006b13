// A tracker that was given everything: where the tags sit, the rest pose, and what they look like.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

constexpr int kAveraged = 25;

ReferenceImage averaged(const render::Scene& scene, std::mt19937& random) {
  ReferenceImage image{scene.width, scene.height, kAveraged,
                       std::vector<float>(static_cast<std::size_t>(scene.width * scene.height))};
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < kAveraged; ++i) {
    const render::Picture picture = render::develop(scene, light, random);
    for (std::size_t p = 0; p < image.level.size(); ++p)
      image.level[p] += static_cast<float>(picture.pixels[p]) / kAveraged;
  }
  return image;
}

struct Loaded {
  render::Scene scene = render::roof();
  std::mt19937 random{21};
  Tracker tracker;
  int shown = 0;

  explicit Loaded(const render::Scene& pictured)
      : tracker(render::camera_of(scene), target(), options(pictured)) {}

  TargetDescription target() const {
    TargetDescription target;
    for (std::size_t t = 0; t < 2; ++t)
      target.tags[t].platform_T_tag =
          render::rest_pose(scene).inverse() * scene.tags[t].camera_T_tag;
    return target;
  }
  ReferenceOptions options(const render::Scene& pictured) {
    return {kAveraged, render::rest_pose(scene), averaged(pictured, random)};
  }
  Track show(const Vector6& displacement) {
    const render::Picture picture = render::take(scene, displacement, random);
    Frame frame;
    frame.image = picture.view();
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * shown++;
    return tracker.track(frame);
  }
};

void expect_at(const Vector6& truth, const Track& track) {
  ASSERT_EQ(track.status, Status::ok);
  for (int axis = 0; axis < 6; ++axis) {
    const double error = std::abs(track.displacement[axis] - truth[axis]);
    EXPECT_LT(error, 4 * std::sqrt(track.covariance(axis, axis))) << axis;
    EXPECT_LT(error, axis < 2 ? 0.2e-6 : axis == 2 ? 1e-6 : 0.2e-3) << axis;
  }
}

TEST(LoadedAppearance, IsOkFromTheFirstFrameAndZeroAtRest) {
  Loaded bench(render::roof());
  const Track first = bench.show(Vector6::Zero());
  expect_at(Vector6::Zero(), first);
  EXPECT_EQ(first.diagnostic, Diagnostic::none);
  Vector6 displacement;
  displacement << 0.1e-3, -0.05e-3, 0.2e-3, 0.01, 0, -0.02;
  for (int i = 0; i < 20; ++i) {
    const Track track = bench.show(i % 2 == 0 ? displacement : Vector6(Vector6::Zero()));
    expect_at(i % 2 == 0 ? displacement : Vector6(Vector6::Zero()), track);
    EXPECT_EQ(track.diagnostic, Diagnostic::none);
  }
}

TEST(LoadedAppearance, NeedsNoRestToStartFrom) {
  Loaded bench(render::roof());
  Vector6 displacement;
  displacement << 0.4e-3, -0.3e-3, 0.3e-3, 0.03, 0.02, -0.04;
  expect_at(displacement, bench.show(displacement));
}

TEST(LoadedAppearance, PictureOfAnotherTargetIsSaidToBeWrongAndGivesNoNumbers) {
  constexpr int kFrames = 40;
  render::Scene other = render::roof();
  // Upside down.
  for (render::PrintedTag& tag : other.tags) {
    std::reverse(tag.rows.begin(), tag.rows.end());
    for (std::string& row : tag.rows) std::reverse(row.begin(), row.end());
  }
  Loaded bench(other);
  int diagnostics = 0;
  for (int i = 0; i < kFrames; ++i) {
    const Track track = bench.show(Vector6::Zero());
    diagnostics += track.diagnostic == Diagnostic::appearance_does_not_fit ? 1 : 0;
    EXPECT_NE(track.status, Status::ok) << i;
    EXPECT_TRUE(track.displacement.isZero(0)) << i;
  }
  EXPECT_GE(diagnostics, 1);
}

TEST(LoadedAppearance, PictureOfTagsGluedOtherwiseIsNotBelieved) {
  render::Scene turned = render::roof();
  for (render::PrintedTag& tag : turned.tags)
    tag.camera_T_tag.linear() = tag.camera_T_tag.linear() *
                                Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Loaded bench(turned);
  bool said = false;
  for (int i = 0; i < 40; ++i) {
    const Track track = bench.show(Vector6::Zero());
    EXPECT_NE(track.status, Status::ok) << i;
    said = said || track.diagnostic == Diagnostic::appearance_does_not_fit;
  }
  EXPECT_TRUE(said);
}

}  // namespace
}  // namespace tagwrench
