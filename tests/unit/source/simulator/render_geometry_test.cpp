// Where edges lie in the picture, against projections made by hand or by OpenCV, which the
// simulator does not use.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/renderer.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench::sim {
namespace {

constexpr double kEdgeTolerance_px = 0.02;
constexpr int kHalfWindow_px = 7;

/// Nothing but geometry and a symmetric point spread.
Scenario geometry_only() {
  Scenario s;
  s.optics.vignetting = 0;
  s.light.unevenness = 0;
  s.light.ambient = 1;
  s.light.glare_counts = 0;
  s.target.ink_spread = 0;
  s.target.ink_edge_roughness = 0;
  s.target.ink_grain = 0;
  s.target.paper_raggedness = 0;
  s.noise = {0.6, 0};  // dithers: flat areas are not off by half a grey level
  return s;
}

Scenario one_facing_tag(double x_m, double y_m, double z_m) {
  Scenario s = geometry_only();
  s.camera.distortion = {};
  s.camera.cx_px = 321.37;
  s.camera.cy_px = 238.81;
  s.optics.defocus_px_per_m = 0;
  s.target.position_error = 0;
  s.target.rotation_error = 0;
  s.target.tags = {{5, {0, 0, 0}, {0, 0, 0}}};
  s.target.rest_position = {x_m, y_m, z_m};
  s.trajectory.motion = Motion::rest;
  return s;
}

/// First moment of an edge along a row or a column: the place where a step of the same contrast
/// would lie.
double edge_position(const ImageView& image, double guess, int line, bool along_row) {
  const int middle = static_cast<int>(std::lround(guess));
  const auto level = [&](int i) {
    const int row = along_row ? line : i;
    const int column = along_row ? i : line;
    return static_cast<double>(image.pixels[row * image.stride + column]);
  };
  const double before = level(middle - kHalfWindow_px);
  const double after = level(middle + kHalfWindow_px);
  double sum = 0;
  for (int i = middle - kHalfWindow_px; i <= middle + kHalfWindow_px; ++i)
    sum += (level(i) - after) / (before - after);
  return middle - kHalfWindow_px - 0.5 + sum;
}

double mean_edge(const ImageView& image, double guess, int first, int last, bool along_row) {
  double sum = 0;
  for (int line = first; line <= last; ++line) sum += edge_position(image, guess, line, along_row);
  return sum / (last - first + 1);
}

TEST(RenderGeometry, FacingTagLiesWhereThePinholeFormulaPutsIt) {
  for (const double x_mm : {0.0, 0.31, -1.07}) {
    const double y_mm = 0.6 * x_mm + 0.2;
    const double z_mm = 20.3;
    SimulatorSource source(one_facing_tag(x_mm * 1e-3, y_mm * 1e-3, z_mm * 1e-3), false);
    Frame frame;
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    // u = cx + f x / z for the black square's edges, +-1.9 mm from its centre.
    const double left = 321.37 + 805 * (x_mm - 1.9) / z_mm;
    const double right = 321.37 + 805 * (x_mm + 1.9) / z_mm;
    const double top = 238.81 + 805 * (y_mm - 1.9) / z_mm;
    const double bottom = 238.81 + 805 * (y_mm + 1.9) / z_mm;
    const int first_row = static_cast<int>(top) + 15;
    const int last_row = static_cast<int>(bottom) - 15;
    const int first_column = static_cast<int>(left) + 15;
    const int last_column = static_cast<int>(right) - 15;
    EXPECT_NEAR(mean_edge(frame.image, left, first_row, last_row, true), left, kEdgeTolerance_px);
    EXPECT_NEAR(mean_edge(frame.image, right, first_row, last_row, true), right, kEdgeTolerance_px);
    EXPECT_NEAR(mean_edge(frame.image, top, first_column, last_column, false), top,
                kEdgeTolerance_px);
    EXPECT_NEAR(mean_edge(frame.image, bottom, first_column, last_column, false), bottom,
                kEdgeTolerance_px);
  }
}

TEST(RenderGeometry, InkSpreadMovesEveryInkEdgeOutwards) {
  Scenario s = one_facing_tag(0, 0, 21e-3);
  s.target.ink_spread = 20e-6;
  SimulatorSource source(s, false);
  Frame frame;
  source.read(frame);
  const double left = 321.37 - 805 * 1.92 / 21;
  const double right = 321.37 + 805 * 1.92 / 21;
  EXPECT_NEAR(mean_edge(frame.image, left, 185, 290, true), left, kEdgeTolerance_px);
  EXPECT_NEAR(mean_edge(frame.image, right, 185, 290, true), right, kEdgeTolerance_px);
}

struct EdgeErrors {
  double worst_mean_px = 0;
  int edges = 0;
};

/// Left and right edges of every black square, row by row, against OpenCV's projection of the true
/// pose at each row.
template <typename PoseAtRow>
EdgeErrors compare_edges(const Scenario& s, const ImageView& image,
                         const std::vector<PlacedTag>& tags, const PoseAtRow& pose_at_row) {
  const Camera& c = s.camera;
  const cv::Matx33d matrix(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  const std::vector<double> distortion(c.distortion.begin(), c.distortion.end());
  const double half = 0.5 * s.target.tag_size;
  const auto project_along = [&](const RigidPose& pose, double side) {
    std::vector<cv::Point3d> points;
    for (int i = 5; i <= 95; ++i) {
      const Eigen::Vector3d p = pose * Eigen::Vector3d(side * half, (0.02 * i - 1) * half, 0);
      points.emplace_back(p.x(), p.y(), p.z());
    }
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, distortion, pixels);
    return pixels;
  };
  EdgeErrors errors;
  for (const PlacedTag& tag : tags) {
    for (const double side : {-1.0, 1.0}) {
      const auto rough =
          project_along(pose_at_row(0.5 * (c.height_px - 1)) * tag.platform_T_tag, side);
      const int first = static_cast<int>(std::ceil(rough.front().y)) + 6;
      const int last = static_cast<int>(std::floor(rough.back().y)) - 6;
      double sum = 0;
      for (int row = first; row <= last; ++row) {
        const auto pixels = project_along(pose_at_row(row) * tag.platform_T_tag, side);
        const auto below = std::find_if(pixels.begin(), pixels.end(),
                                        [&](const cv::Point2d& p) { return p.y > row; });
        const cv::Point2d a = *(below - 1);
        const double expected = a.x + (below->x - a.x) * (row - a.y) / (below->y - a.y);
        sum += edge_position(image, expected, row, true) - expected;
      }
      ++errors.edges;
      errors.worst_mean_px = std::max(errors.worst_mean_px, std::abs(sum) / (last - first + 1));
    }
  }
  return errors;
}

TEST(RenderGeometry, MovingRoofThroughADistortingLensAgreesWithOpenCvAtMidExposure) {
  Scenario s = geometry_only();
  s.camera.distortion = {-0.2, 0.08, 1e-3, -8e-4, 0.01};
  s.trajectory.rest_time = 0;
  SimulatorSource source(s, false);
  Frame frame;
  double fastest_px = 0;
  Vector6 before = Vector6::Zero();
  for (int i = 0; i < 90; ++i) {
    source.read(frame);
    const Vector6 d = source.truth().displacement;
    fastest_px =
        std::max(fastest_px, (d - before).head<2>().norm() / 0.04 * s.exposure.time * 805 / 21e-3);
    before = d;
    if (i % 10 != 9) continue;
    const auto pose = [&](double) { return source.truth().camera_T_platform; };
    const EdgeErrors errors = compare_edges(s, frame.image, source.truth().tags, pose);
    EXPECT_EQ(errors.edges, 4);
    EXPECT_LT(errors.worst_mean_px, kEdgeTolerance_px) << "frame " << i;
  }
  EXPECT_GT(fastest_px, 1.0);  // the test is about motion blur, too
}

TEST(RenderGeometry, RollingShutterShowsEveryRowAtItsOwnTime) {
  Scenario s = geometry_only();
  s.exposure.rolling_readout = 20e-3;
  s.trajectory.motion = Motion::sweep;
  s.trajectory.axis = 0;
  s.trajectory.rest_time = 0;
  s.trajectory.sweep_from = 2;
  s.trajectory.sweep_to = 2.001;
  const TrajectoryPlayer player(s.trajectory, s.seed);
  Renderer renderer(s);
  PlatformMotion motion(s.mechanics, player, 0, 0.1);
  const double time = 1.0 + 1e-3;  // a zero crossing: the platform is fastest
  motion.advance_to(time + renderer.half_window());
  std::vector<std::uint8_t> pixels(640 * 480);
  renderer.render(motion, time, 0, pixels.data());
  const auto pose_at_row = [&](double row) {
    const double row_time = time + (row - 239.5) / 480 * 20e-3;
    return platform_pose(s.target, motion.at(row_time).displacement);
  };
  const double sweep_px =
      (motion.at(time + 10e-3).displacement[0] - motion.at(time - 10e-3).displacement[0]) * 805 /
      21e-3;
  ASSERT_GT(std::abs(sweep_px), 5.0);
  // Bands of eight rows share one time, and a tag does not end on a band: a little is left.
  constexpr double kRollingTolerance_px = 0.05;
  const EdgeErrors errors =
      compare_edges(s, {pixels.data(), 640, 480, 640}, renderer.tags(), pose_at_row);
  EXPECT_LT(errors.worst_mean_px, kRollingTolerance_px);
}

TEST(RenderGeometry, TheMidpointOfTheTagCentresIsThePlatformOrigin) {
  for (std::uint64_t seed = 1; seed < 5; ++seed) {
    Scenario s;
    s.seed = seed;
    const std::vector<PlacedTag> tags = placed_tags(s);
    constexpr double kTolerance_m = 1e-12;
    EXPECT_LT((tags[0].platform_T_tag.position + tags[1].platform_T_tag.position).norm(),
              kTolerance_m);
    // Hand-placed: not where the drawing puts them.
    EXPECT_GT((tags[0].platform_T_tag.position - s.target.tags[0].position).norm(), 5e-6);
  }
}

TEST(RenderGeometry, RoofRisesTowardsTheCameraAtTheRidge) {
  Scenario s;
  s.target.position_error = 0;
  s.target.rotation_error = 0;
  const std::vector<PlacedTag> tags = placed_tags(s);
  const Eigen::Vector3d upper_lower_edge = tags[0].platform_T_tag * Eigen::Vector3d(0, 1.9e-3, 0);
  const Eigen::Vector3d lower_upper_edge = tags[1].platform_T_tag * Eigen::Vector3d(0, -1.9e-3, 0);
  constexpr double kTolerance_m = 1e-9;
  EXPECT_NEAR(upper_lower_edge.z(), -1.9e-3 * std::numbers::sqrt2 / 2, kTolerance_m);
  EXPECT_NEAR(lower_upper_edge.z(), -1.9e-3 * std::numbers::sqrt2 / 2, kTolerance_m);
  EXPECT_LT(upper_lower_edge.y(), 0);
  EXPECT_GT(lower_upper_edge.y(), 0);
}

}  // namespace
}  // namespace tagwrench::sim
