#include "tests/bench/tracker_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace tagwrench::bench {
namespace {

constexpr double kStep_px = 0.5;  // the farthest that a point of the tags moves; the outer samples
                                  // of the difference move twice as far

// Half a grey level of noise, the same in every picture of a difference: it cancels, and rounding
// becomes a small error without bias.
constexpr double kDither_counts = 0.5;

sim::Scenario with_dither_alone(sim::Scenario scenario) {
  scenario.noise = {kDither_counts, 0};
  scenario.compression.jpeg_quality = 0;
  return scenario;
}

double half_paper(const sim::Target& target) { return 0.5 * target.tag_size + target.border; }

}  // namespace

BoundOfScenario::BoundOfScenario(const sim::Scenario& scenario)
    : scenario_(scenario),
      player_(scenario.trajectory, scenario.seed),
      renderer_(with_dither_alone(scenario)),
      motion_(scenario.mechanics, player_, 0, 2 * renderer_.half_window() + 0.01),
      picture_(static_cast<std::size_t>(scenario.camera.width_px) * scenario.camera.height_px) {}

const BoundOfScenario::Picture& BoundOfScenario::render(const Vector6& displacement,
                                                        std::uint64_t dither) {
  motion_.set_state({displacement, Vector6::Zero()});
  renderer_.render(motion_, 0, dither, picture_.data());
  return picture_;
}

// Which pixels count, and on which tag each lies.
std::vector<BoundOfScenario::Pixel> BoundOfScenario::pixels_on_tags(
    const Vector6& displacement) const {
  const sim::Camera& camera = scenario_.camera;
  const sim::RigidPose pose = sim::platform_pose(scenario_.target, displacement);
  const double half = half_paper(scenario_.target);
  std::vector<Pixel> pixels;
  for (std::size_t t = 0; t < renderer_.tags().size(); ++t) {
    const sim::RigidPose plane = pose * renderer_.tags()[t].platform_T_tag;
    Eigen::Matrix3d ray_from_plane;
    ray_from_plane << plane.rotation.col(0), plane.rotation.col(1), plane.position;
    const Eigen::Matrix3d plane_from_ray = ray_from_plane.inverse();
    for (int row = 0; row < camera.height_px; ++row) {
      for (int column = 0; column < camera.width_px; ++column) {
        Eigen::Vector2d ray;
        if (!sim::unproject(camera, {column, row}, ray)) continue;
        const Eigen::Vector2d on_paper = (plane_from_ray * ray.homogeneous()).hnormalized();
        if (on_paper.cwiseAbs().maxCoeff() > half) continue;
        pixels.push_back(
            {static_cast<std::size_t>(row) * camera.width_px + column, static_cast<int>(t)});
      }
    }
  }
  return pixels;
}

BoundOfScenario::Slopes BoundOfScenario::slopes(const Vector6& displacement, double step_px,
                                                const std::vector<Pixel>& pixels,
                                                std::uint64_t dither) {
  const double depth = scenario_.target.rest_position.z();
  const double metres_per_px = depth / scenario_.camera.fx_px;
  // The papers reach this far from the platform's origin.
  const double reach = 2 * half_paper(scenario_.target);
  Vector6 step;
  step << 1, 1, depth / reach, 1 / reach, 1 / reach, 1 / reach;
  step *= step_px * metres_per_px;
  Slopes result = Slopes::Zero(static_cast<Eigen::Index>(pixels.size()), 6);
  for (int axis = 0; axis < 6; ++axis) {
    for (const auto& [place, weight] :
         {std::pair{1.0, 8.0}, {-1.0, -8.0}, {2.0, -1.0}, {-2.0, 1.0}}) {
      const Picture& moved =
          render(displacement + place * step[axis] * Vector6::Unit(axis), dither);
      const double factor = weight / (12 * step[axis]);
      for (std::size_t i = 0; i < pixels.size(); ++i)
        result(static_cast<Eigen::Index>(i), axis) += factor * moved[pixels[i].index];
    }
  }
  return result;
}

Matrix6 BoundOfScenario::covariance(const Vector6& displacement, double step_px, int& count) {
  const std::vector<Pixel> pixels = pixels_on_tags(displacement);
  count = static_cast<int>(pixels.size());
  // Rounding errors of slopes would count as information if squared. The product of two slopes
  // with rounding of their own has none of them in its mean.
  const Slopes one = slopes(displacement, step_px, pixels, 0);
  const Slopes other = slopes(displacement, step_px, pixels, 1);
  const Picture& picture = render(displacement, 2);

  const auto unknowns = static_cast<Eigen::Index>(6 + 2 * renderer_.tags().size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd a(unknowns), b(unknowns);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double level = picture[pixels[i].index];
    const double variance = std::pow(scenario_.noise.read_counts, 2) +
                            scenario_.noise.shot_counts_per_count * level + 1.0 / 12;
    a.setZero();
    a[6 + 2 * pixels[i].tag] = level / 255;
    a[7 + 2 * pixels[i].tag] = 1;
    b = a;
    a.head<6>() = one.row(static_cast<Eigen::Index>(i)).transpose();
    b.head<6>() = other.row(static_cast<Eigen::Index>(i)).transpose();
    information += (a * b.transpose() + b * a.transpose()) / (2 * variance);
  }
  // Metres and radians are far apart; scaled, the inverse is well conditioned.
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
  return inverse.topLeftCorner<6, 6>();
}

Bound BoundOfScenario::at(const Vector6& displacement) {
  Bound bound;
  bound.sigma = covariance(displacement, kStep_px, bound.pixels).diagonal().cwiseSqrt();
  return bound;
}

Matrix6 BoundOfScenario::covariance(const Vector6& displacement) {
  int pixels = 0;
  return covariance(displacement, kStep_px, pixels);
}

double BoundOfScenario::change_with_step(const Vector6& displacement) {
  int pixels = 0;
  const Vector6 whole = covariance(displacement, kStep_px, pixels).diagonal().cwiseSqrt();
  const Vector6 less = covariance(displacement, 0.6 * kStep_px, pixels).diagonal().cwiseSqrt();
  return (less.cwiseQuotient(whole).array() - 1).abs().maxCoeff();
}

}  // namespace tagwrench::bench
