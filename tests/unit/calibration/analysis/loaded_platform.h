// A spring platform of numbers: hand-like loads, displacements by a known matrix, a reference with
// times of its own.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "host/calibration/analysis/trial_csv.h"

namespace tagwrench::test {

/// N/m and N m/rad, with some coupling.
inline Eigen::Matrix<double, 6, 6> true_stiffness() {
  Eigen::Matrix<double, 6, 6> k = Eigen::Matrix<double, 6, 6>::Zero();
  k.diagonal() << 1120, 1120, 2800, 0.30, 0.25, 0.20;
  k(0, 4) = 9;
  k(4, 0) = 9;
  k(1, 3) = -9;
  k(3, 1) = -9;
  return k;
}

struct LoadedPlatform {
  double seconds = 20;
  double reading_rate = 50;     ///< Hz
  double reference_rate = 100;  ///< Hz
  double lag = 0.040;           ///< s, that readings come late
  double lag_drift = 0;         ///< s per s
  double start = 3;             ///< s
  double noise = 1;             ///< times 0.3 um and 0.03 mrad
  double reference_noise = 1;   ///< times 5 mN and 0.15 mN m
  Eigen::Matrix<double, 6, 1> amplitude = {1.0, 1.0, 2.0, 0.02, 0.02, 0.015};  ///< N, N m
  Eigen::Matrix<double, 6, 1> bias = Eigen::Matrix<double, 6, 1>::Zero();
  unsigned seed = 1;

  Eigen::Matrix<double, 6, 1> load(double t) const {
    Eigen::Matrix<double, 6, 1> w;
    for (int k = 0; k < 6; ++k) {
      // Frequencies without a common period, 0.3 to 1.6 Hz, another mix for each axis.
      const double a = 0.31 + 0.083 * k;
      const double b = 1.57 - 0.111 * k;
      w[k] = bias[k] + amplitude[k] * (0.7 * std::sin(6.2832 * a * t + k) +
                                       0.3 * std::sin(6.2832 * b * t + 2 * k));
    }
    return w;
  }

  study::Trial trial() const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    study::Trial trial;
    trial.name = "platform";
    trial.feature_names = study::displacement_names();
    const Eigen::Matrix<double, 6, 6> compliance = true_stiffness().inverse();
    const auto n = static_cast<Eigen::Index>(seconds * reading_rate);
    const auto m = static_cast<Eigen::Index>(seconds * reference_rate);
    trial.time.resize(n);
    trial.features.resize(n, 6);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = start + static_cast<double>(i) / reading_rate;
      const double late = lag + lag_drift * (t - start);
      trial.time[i] = t;
      trial.features.row(i) = (compliance * load(t - late)).transpose();
      for (Eigen::Index k = 0; k < 6; ++k)
        trial.features(i, k) += noise * (k < 3 ? 0.3e-6 : 0.03e-3) * normal(random);
    }
    trial.reference_time.resize(m);
    trial.reference.resize(m, 6);
    for (Eigen::Index i = 0; i < m; ++i) {
      const double t = start + static_cast<double>(i) / reference_rate;
      trial.reference_time[i] = t;
      trial.reference.row(i) = load(t).transpose();
      for (Eigen::Index k = 0; k < 6; ++k)
        trial.reference(i, k) += reference_noise * (k < 3 ? 5e-3 : 0.15e-3) * normal(random);
    }
    return trial;
  }
};

}  // namespace tagwrench::test
