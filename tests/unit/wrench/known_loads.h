// A sensor of known stiffness, loaded on paper: plans of hung masses and of movements by hand, with
// every error that a person's bench has.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "host/wrench/estimate.h"
#include "host/wrench/fit.h"

namespace tagwrench::test {

/// The paper's springs: 2.8 N/mm along z, 0.28 N/mm across.
inline Matrix6 nominal_stiffness() {
  Springs springs;
  for (const double x : {-14e-3, 14e-3}) {
    for (const double y : {-7e-3, 7e-3}) springs.centres.push_back({x, y, 8e-3});
  }
  springs.bending = 5e-3;
  springs.torsion = 5e-3;
  return stiffness(springs);
}

struct Errors {
  double mass = 0.003;    ///< relative, each mass its own
  double gravity = 0.01;  ///< rad, each mounting its own
  double point = 0.2e-3;  ///< m, each point and coordinate its own
  double hang = 3e-4;     ///< N, each hang its own
  double pose = 1;        ///< of the tracker's noise
  double nonlinear = 0;   ///< of full load: quadratic in the load
  double unstated = 1;    ///< true errors over those that are stated
  double asymmetry =
      0.003;  ///< of the stiffness: the tracker's axes are not quite those of the load
};

class KnownLoads {
 public:
  explicit KnownLoads(unsigned seed, const Errors& errors = {}) : errors_(errors), random_(seed) {
    // A real sensor is not what its springs' description says.
    const Matrix6 nominal = nominal_stiffness();
    stiffness = nominal;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) {
        const double unit = std::sqrt(nominal(i, i) * nominal(j, j));
        const double off = 0.08 * normal() * unit;
        stiffness(i, j) += off + errors.asymmetry * normal() * unit;
        if (i != j) stiffness(j, i) += off;
      }
    }
    const Vector6 sigma =
        (Vector6() << 0.1e-6, 0.1e-6, 0.6e-6, 30e-6, 30e-6, 12e-6).finished() * errors.pose;
    pose_covariance = sigma.cwiseAbs2().asDiagonal();
  }

  double normal() { return normal_(random_); }
  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }

  Vector6 noise() { return pose_covariance.llt().matrixL() * unit(); }
  Vector6 unit() {
    Vector6 v;
    for (int i = 0; i < 6; ++i) v[i] = normal();
    return v;
  }
  /// What the tracker would see under a wrench.
  Vector6 displacement_of(const Vector6& wrench) const {
    const Vector6 bent =
        wrench + errors_.nonlinear * wrench.cwiseProduct(wrench.cwiseAbs()).cwiseQuotient(full);
    return stiffness.partialPivLu().solve(bent);
  }

  /// Before: rests; then masses at points in mountings; every step one observation.
  std::vector<Observation> hung(const std::vector<Eigen::Vector3d>& mountings,
                                const std::vector<Eigen::Vector3d>& points,
                                const std::vector<double>& masses) {
    std::vector<Observation> out;
    std::vector<double> mass_off;
    std::vector<Eigen::Vector3d> point_off;
    for (std::size_t i = 0; i < masses.size(); ++i)
      mass_off.push_back(1 + errors_.unstated * errors_.mass * normal());
    for (std::size_t i = 0; i < points.size(); ++i)
      point_off.push_back(errors_.unstated * errors_.point * unit().head<3>());
    int step = 0;
    for (std::size_t m = 0; m < mountings.size(); ++m) {
      const Vector6 zero = displacement_of(0.2 * full.cwiseProduct(unit()) * 0.3);
      const Eigen::Vector3d down = mountings[m].normalized();
      const Eigen::Vector3d tilt = errors_.unstated * errors_.gravity * unit().head<3>();
      const Eigen::Vector3d true_down = (down + tilt.cross(down)).normalized();
      const auto add = [&](const Vector6& true_wrench, Observation o) {
        o.time = 10.0 * step;
        o.step = step++;
        o.zero = static_cast<int>(m);
        o.displacement = displacement_of(true_wrench) + zero + noise();
        o.displacement_covariance = pose_covariance;
        out.push_back(o);
      };
      add(Vector6::Zero(), {});
      for (std::size_t p = 0; p < points.size(); ++p) {
        for (std::size_t k = 0; k < masses.size(); ++k) {
          Observation o;
          set_line_load({.force = masses[k] * 9.80665,
                         .direction = down,
                         .point = points[p],
                         .force_sigma = errors_.mass,
                         .direction_sigma = errors_.gravity,
                         .point_sigma = errors_.point,
                         .force_name = "mass " + std::to_string(k),
                         .direction_name = "gravity " + std::to_string(m),
                         .point_name = "point " + std::to_string(p),
                         .force_noise = errors_.hang},
                        o);
          const Eigen::Vector3d force = masses[k] * mass_off[k] * 9.80665 * true_down +
                                        errors_.unstated * errors_.hang * normal() * down;
          Vector6 wrench;
          wrench << force, (points[p] + point_off[p]).cross(force);
          add(wrench, o);
        }
      }
      add(Vector6::Zero(), {});
    }
    return out;
  }

  /// Sideways four ways and upright two ways: all six dimensions.
  std::vector<Observation> six_orientations() {
    return hung({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, -1}, {0, 0, 1}},
                {{15e-3, 10e-3, -5e-3}, {-15e-3, 10e-3, -5e-3}, {0, 0, 0}}, {0.05, 0.1});
  }

  /// A rest before and after, and each wrench held for a step, told to `sigma` of full load.
  std::vector<Observation> applied(const std::vector<Vector6>& wrenches, double sigma = 1e-3) {
    std::vector<Observation> out;
    const auto add = [&](const Vector6& wrench, const Vector6& told_sigma) {
      Observation o;
      o.step = static_cast<int>(out.size());
      o.time = 10.0 * o.step;
      o.displacement = displacement_of(wrench) + noise();
      o.displacement_covariance = pose_covariance;
      o.wrench = wrench + told_sigma.cwiseProduct(unit());
      o.wrench_covariance = told_sigma.cwiseAbs2().asDiagonal();
      out.push_back(o);
    };
    add(Vector6::Zero(), Vector6::Zero());
    for (const Vector6& wrench : wrenches) add(wrench, sigma * full);
    add(Vector6::Zero(), Vector6::Zero());
    return out;
  }

  /// A load that the calibration has not seen, and what the tracker sees.
  Vector6 random_load() {
    Vector6 w;
    for (int i = 0; i < 6; ++i) w[i] = full[i] * uniform();
    return w;
  }

  Matrix6 stiffness;
  Matrix6 pose_covariance;
  Vector6 full = (Vector6() << 1, 1, 1, 0.015, 0.015, 0.015).finished();

 private:
  Errors errors_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace tagwrench::test
