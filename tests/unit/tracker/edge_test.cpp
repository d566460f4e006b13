// The parts under the tracker: projection, edges of a pattern, and one profile.
#include <gtest/gtest.h>

#include <cmath>

#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/rotation.h"
#include "tests/support/differences.h"

namespace tagwrench {
namespace {

CameraModel wide_angle() {
  CameraModel camera;
  camera.distortion = {-0.31, 0.12, 0.004, -0.003, 0.05};
  return camera;
}

TEST(Projection, JacobianIsTheDerivative) {
  const CameraModel camera = wide_angle();
  const Eigen::Vector3d p(0.003, -0.002, 0.02);
  const ProjectedPoint at = project(camera, p);
  ASSERT_TRUE(at.valid);
  const Eigen::MatrixXd slopes = test::differences<3>(
      [&](const Eigen::Vector3d& step) { return project(camera, p + step).pixel; }, 1e-7);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_LT((slopes - at.jacobian).col(axis).norm(), 1e-6 * at.jacobian.norm()) << axis;
}

TEST(Projection, RefusesWhatIsBehindTheLens) {
  EXPECT_FALSE(project(CameraModel{}, {0, 0, -0.02}).valid);
  EXPECT_FALSE(project(CameraModel{}, {0, 0, 0}).valid);
  EXPECT_FALSE(project(CameraModel{}, Eigen::Vector3d::Constant(std::nan(""))).valid);
}

TEST(Rotation, MotionBetweenUndoesMoved) {
  Eigen::Isometry3d from = Eigen::Isometry3d::Identity();
  from.linear() = rotation_from_vector({0.4, -0.7, 0.2});
  from.translation() << 0.01, 0.02, 0.03;
  Vector6 motion;
  motion << 1e-3, -2e-3, 3e-3, 0.3, -0.2, 0.1;
  EXPECT_LT((motion_between(from, moved(from, motion)) - motion).norm(), 1e-12);
}

/// 3 x 3 cells: a black ring around one white cell.
TagPattern ring() {
  TagPattern pattern;
  pattern.cells = 3;
  pattern.size = 3e-3;
  pattern.border = 0.4e-3;
  pattern.white = {0, 0, 0, 0, 1, 0, 0, 0, 0};
  return pattern;
}

TEST(Edges, RingHasOuterAndInnerSidesOfOppositePolarity) {
  const EdgeTag tag = make_edge_tag(ring(), Eigen::Isometry3d::Identity());
  int outer = 0;
  int inner = 0;
  for (const EdgePoint& point : tag.points) {
    if (point.normal != EdgeNormal::plus_x) continue;
    // White lies to the right of the ring's right side and of the inner cell's left side.
    if (std::abs(point.x - 1.5e-3) < 1e-9) {
      ++outer;
      EXPECT_NEAR(point.reach, 0.4e-3, 1e-9);
    } else if (std::abs(point.x + 0.5e-3) < 1e-9) {
      ++inner;
      EXPECT_NEAR(point.reach, 1e-3, 1e-9);
    } else {
      ADD_FAILURE() << point.x;
    }
  }
  EXPECT_EQ(outer, 3 * inner);
  EXPECT_GT(inner, 0);
}

/// A vertical edge, dark to the left, blurred, at column `edge`.
std::vector<float> step_image(double edge, double blur_px) {
  std::vector<float> image(200 * 200);
  for (int i = 0; i < 200 * 200; ++i) {
    image[static_cast<std::size_t>(i)] =
        static_cast<float>(50 + 75 * (1 + std::erf((i % 200 - edge) / (blur_px * std::sqrt(2.0)))));
  }
  return image;
}

struct Profile {
  EdgeMeter meter;
  EdgeTag tag;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::vector<EdgeMeasurement> out{1};

  Profile() : meter(camera()) {
    EdgePoint point;
    point.reach = 1;
    tag.points = {point};
    pose.translation().z() = 1;
  }
  static CameraModel camera() {
    CameraModel model;
    model.fx_px = model.fy_px = 800;
    model.cx_px = model.cy_px = 100.3;
    return model;
  }
  EdgeMeasurement measure(double edge, double blur_px) {
    const std::vector<float> image = step_image(edge, blur_px);
    meter.measure(PixelView<float>{image.data(), 200, 200, 200}, tag, pose, 6.0, false, out);
    return out[0];
  }
};

TEST(EdgeMeter, SymmetricEdgeWhereExpectedReadsZeroAtAnyBlur) {
  constexpr double kBias_px = 0.006;  // of bilinear sampling
  Profile profile;
  for (const double blur_px : {0.8, 1.5, 3.0}) {
    const EdgeMeasurement m = profile.measure(100.3, blur_px);
    ASSERT_TRUE(m.valid);
    EXPECT_NEAR(m.offset_px, 0, kBias_px) << blur_px;
  }
}

TEST(EdgeMeter, GainIsTheSlopeOfTheReading) {
  Profile profile;
  for (const double blur_px : {0.8, 1.5, 2.5}) {
    const double slope =
        (profile.measure(100.5, blur_px).offset_px - profile.measure(100.1, blur_px).offset_px) /
        0.4;
    EXPECT_NEAR(profile.measure(100.3, blur_px).gain, slope, 0.03) << blur_px;
    EXPECT_GT(slope, 0.2);
  }
}

TEST(EdgeMeter, EdgeOfTheWrongPolarityIsNotAnEdge) {
  Profile profile;
  profile.tag.points[0].normal = EdgeNormal::minus_x;
  EXPECT_FALSE(profile.measure(100.3, 1.0).valid);
}

TEST(EdgeMeter, RowIsTheDerivativeOfTheOffset) {
  Profile profile;
  profile.tag.points[0].x = 0.01;
  profile.tag.points[0].y = -0.02;
  const double edge = 100.3 + 8.0;
  const EdgeMeasurement m = profile.measure(edge, 1.5);
  ASSERT_TRUE(m.valid);
  for (int axis = 0; axis < 6; ++axis) {
    Vector6 motion = Vector6::Zero();
    motion[axis] = 2e-4;
    const Eigen::Isometry3d rest = profile.pose;
    profile.pose = moved(rest, motion);
    const double after = profile.measure(edge, 1.5).offset_px;
    profile.pose = moved(rest, -motion);
    const double before = profile.measure(edge, 1.5).offset_px;
    profile.pose = rest;
    // Moving the platform one way moves the image's edge the other way in its eyes.
    EXPECT_NEAR(-(after - before) / 4e-4 / m.gain, m.row[axis], 0.03 * m.row.norm()) << axis;
  }
}

}  // namespace
}  // namespace tagwrench
