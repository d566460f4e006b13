// Derivatives against differences, and eliminations against the full equations.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "host/calibration/target/equations.h"
#include "host/tracker/acquire.h"
#include "host/tracker/camera_model.h"
#include "tests/support/differences.h"
#include "tests/unit/calibration/target/target_record.h"

namespace tagwrench {
namespace {

// One picture of the simulated sensor, taken to be one of a platform that has moved far from rest.
class Derivatives : public testing::Test {
 protected:
  Derivatives() {
    sim::Scenario scenario;
    scenario.camera.distortion = {-0.2, 0.1, 2e-3, -1e-3, 0.05};
    sensor_ = parse_sensor(sim::sensor_yaml(scenario), "the test's sensor");
    SimulatorSource source(scenario, /*live=*/false);
    Frame frame;
    source.read(frame);
    const auto& placed = source.truth().tags[0].platform_T_tag;
    Eigen::Isometry3d seen_tag = Eigen::Isometry3d::Identity();
    seen_tag.linear() = placed.rotation;
    seen_tag.translation() = placed.position + source.truth().rest_position;
    frame_pose_.translation() = source.truth().rest_position;
    Vector6 far;
    far << 0.6e-3, -0.8e-3, 0.7e-3, 0.15, -0.1, 0.2;
    rest_pose_ = moved(frame_pose_, far);
    camera_T_tag_ = rest_pose_ * frame_pose_.inverse() * seen_tag;
    const Acquirer acquirer(sensor_.camera, sensor_.target);
    tag_ = make_edge_tag(acquirer.patterns()[0], frame_pose_.inverse() * seen_tag);
    measured_.resize(tag_.points.size());
    const PixelView<std::uint8_t> view{frame.image.pixels, frame.image.width, frame.image.height,
                                       frame.image.stride};
    EdgeMeter(sensor_.camera).measure(view, tag_, frame_pose_, 4.0, false, measured_);
  }

  Eigen::Vector2d pixel(const CameraModel& camera, const Eigen::Isometry3d& frame_pose,
                        const Eigen::Isometry3d& camera_T_tag, const Eigen::Vector3d& point) const {
    return project(camera, frame_pose * (rest_pose_.inverse() * (camera_T_tag * point))).pixel;
  }

  SensorConfig sensor_;
  Eigen::Isometry3d frame_pose_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d rest_pose_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d camera_T_tag_ = Eigen::Isometry3d::Identity();
  EdgeTag tag_;
  std::vector<EdgeMeasurement> measured_;
};

Eigen::Vector3d toward_white(EdgeNormal normal) {
  switch (normal) {
    case EdgeNormal::plus_x: return {1, 0, 0};
    case EdgeNormal::minus_x: return {-1, 0, 0};
    case EdgeNormal::plus_y: return {0, 1, 0};
    case EdgeNormal::minus_y: return {0, -1, 0};
  }
  return Eigen::Vector3d::Zero();
}

TEST_F(Derivatives, AgreeWithDifferencesOfTheProjection) {
  constexpr double kStep = 1e-7;  // m, rad and part
  const CameraModel& camera = sensor_.camera;
  int checked = 0;
  for (std::size_t i = 0; i < measured_.size(); i += 7) {
    if (!measured_[i].valid) continue;
    ++checked;
    const Eigen::Vector3d point(tag_.points[i].x, tag_.points[i].y, 0);
    const Eigen::Vector3d white = toward_white(tag_.points[i].normal);
    const Eigen::Vector3d along(white.y(), -white.x(), 0);
    const auto at = [&](const Eigen::Vector3d& p) {
      return pixel(camera, frame_pose_, camera_T_tag_, p);
    };
    const Eigen::Vector2d tangent = at(point + 1e-7 * along) - at(point - 1e-7 * along);
    Eigen::Vector2d n = Eigen::Vector2d(-tangent.y(), tangent.x()).normalized();
    if (n.dot(at(point + 1e-6 * white) - at(point)) < 0) n = -n;

    const EdgeDerivatives by =
        edge_derivatives(camera, measured_[i], frame_pose_, rest_pose_, camera_T_tag_, point);
    const auto frame_moved = [&](const Vector6& step) {
      return pixel(camera, moved(frame_pose_, step), camera_T_tag_, point);
    };
    const auto tag_moved = [&](const Vector6& step) {
      return pixel(camera, frame_pose_, moved(camera_T_tag_, step), point);
    };
    const Vector6 by_frame = test::differences<6>(frame_moved, kStep).transpose() * n;
    const Vector6 by_tag = test::differences<6>(tag_moved, kStep).transpose() * n;
    for (int axis = 0; axis < 6; ++axis) {
      const double tolerance = axis < 3 ? 0.5 : 2e-3;  // px/m of 4e4, px/rad of 100
      EXPECT_NEAR(by.frame[axis], by_frame[axis], tolerance) << "point " << i << " axis " << axis;
      EXPECT_NEAR(by.tag[axis], by_tag[axis], tolerance) << "point " << i << " axis " << axis;
    }
    const double by_normal =
        n.dot(at(point + kStep * white) - at(point - kStep * white)) / (2 * kStep);
    EXPECT_NEAR(by.normal, by_normal, 0.5);  // px/m
    CameraModel longer = camera;
    longer.fx_px *= 1 + 1e-5;
    longer.fy_px *= 1 + 1e-5;
    const double by_focal =
        n.dot(pixel(longer, frame_pose_, camera_T_tag_, point) - at(point)) / std::log1p(1e-5);
    EXPECT_NEAR(by.focal, by_focal, 1e-3);  // px
    EXPECT_NEAR(by.row_px, at(point).y(), 1e-9);
  }
  EXPECT_GT(checked, 20);
}

// Random equations, solved by elimination and all at once.
TEST(TargetEquations, EliminationSolvesWhatTheFullEquationsSay) {
  constexpr int kViews = 3;
  constexpr int kTags = 2;
  constexpr Eigen::Index kPoints = 16;
  constexpr Eigen::Index kShared = (6 + kPrintModes) * kTags + 2;
  constexpr Eigen::Index kAll = 6 * kViews + kShared + kPoints;
  std::mt19937 random(3);
  std::normal_distribution<double> gauss;
  const auto vector6 = [&] {
    Vector6 v;
    for (double& x : v) x = gauss(random);
    v.head<3>() *= 200;  // as px/m to px/rad
    return v;
  };
  TargetNormal normal(kViews, kTags, kPoints);
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(kAll, kAll);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kAll);
  const Eigen::Index shared = 6 * kViews;
  const Eigen::Index points = shared + kShared;
  const auto add = [&](const Eigen::VectorXd& row, double offset, double weight) {
    full += weight * row * row.transpose();
    right += weight * offset * row;
  };
  for (Eigen::Index p = 0; p < kPoints; ++p) {
    const int tag = static_cast<int>(p % kTags);
    for (int frame = -1; frame < kViews; ++frame) {
      EdgeEquation e;
      e.frame = frame;
      e.tag = tag;
      e.point = p;
      if (frame >= 0) e.by.frame = vector6();
      e.by.tag = vector6();
      e.by.normal = gauss(random);
      e.by.readout = gauss(random);
      e.by.focal = gauss(random);
      e.offset = gauss(random);
      e.weight = 1.0 + static_cast<double>(p % 3);
      normal.add(e);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(kAll);
      if (frame >= 0) row.segment<6>(6 * frame) = e.by.frame;
      row.segment<6>(shared + 6 * tag) = e.by.tag;
      row[shared + kShared - 2] = e.by.readout;
      row[shared + kShared - 1] = e.by.focal;
      row[points + p] = e.by.normal;
      add(row, e.offset, e.weight);
    }
    const double offset = gauss(random);
    PrintModes modes;
    for (double& mode : modes) mode = gauss(random);
    normal.add_print(p, tag, modes, offset, 2.0);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(kAll);
    row[points + p] = 1;
    row.segment<kPrintModes>(shared + normal.print_index(tag)) = -modes;
    add(row, offset, 2.0);
  }
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(kAll);
  for (int tag = 0; tag < kTags; ++tag) {
    for (int mode = 0; mode < kPrintModes; ++mode) {
      const Eigen::Index at = normal.print_index(tag) + mode;
      normal.add_prior(at, 0.3, 0.5);
      add(Eigen::VectorXd::Unit(kAll, shared + at), 0.3, 0.5);
    }
    sizes[shared + normal.print_index(tag) + kSizeMode] = 1;
  }
  normal.add_total_size(0.1, 4.0);
  add(sizes, 0.1, 4.0);
  normal.add_prior(normal.readout_index(), -0.2, 1.5);
  add(Eigen::VectorXd::Unit(kAll, shared + normal.readout_index()), -0.2, 1.5);
  const Eigen::VectorXd solution = full.ldlt().solve(right);
  ASSERT_TRUE(normal.reduce());
  const Eigen::VectorXd step = normal.shared_step(true);
  ASSERT_EQ(step.size(), kShared);
  const Eigen::VectorXd frames = normal.frame_steps(step);
  const double size = solution.norm();
  EXPECT_LT((step - solution.segment(shared, kShared)).norm(), 1e-8 * size);
  EXPECT_LT((frames - solution.head(shared)).norm(), 1e-8 * size);
  EXPECT_LT((normal.point_steps(step, frames) - solution.tail(kPoints)).norm(), 1e-8 * size);
  const Eigen::MatrixXd covariance = full.inverse().block(shared, shared, kShared, kShared);
  EXPECT_LT(
      (normal.information() * covariance - Eigen::MatrixXd::Identity(kShared, kShared)).norm(),
      1e-6);
  // A pull on any unknown moves the shared ones as the full equations say.
  Eigen::VectorXd pulls(kAll);
  for (double& pull : pulls) pull = gauss(random);
  Eigen::VectorXd pulled = pulls.head(shared + kShared);
  for (Eigen::Index p = 0; p < kPoints; ++p) pulled += normal.point_pull(p, pulls[points + p]);
  const Eigen::VectorXd answer = full.ldlt().solve(pulls);
  EXPECT_LT((covariance * normal.reduced_pull(pulled) - answer.segment(shared, kShared)).norm(),
            1e-8 * answer.norm());
  // With the focal length held it must stay, and the others move by less.
  const Eigen::VectorXd held = normal.shared_step(false);
  EXPECT_EQ(held[kShared - 1], 0.0);
  Eigen::MatrixXd without = full;
  without(shared + kShared - 1, shared + kShared - 1) += 1e12;
  const Eigen::VectorXd expected = without.ldlt().solve(right);
  EXPECT_LT((held.head(kShared - 1) - expected.segment(shared, kShared - 1)).norm(), 1e-6 * size);
}

TEST(TargetEquations, APointThatNothingHoldsIsNoSolution) {
  TargetNormal normal(0, 1, 1);
  EXPECT_FALSE(normal.reduce());
}

}  // namespace
}  // namespace tagwrench
