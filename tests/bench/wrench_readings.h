// The paper's experiment: what each way of tracking read in every frame of one run.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/analysis/trial_csv.h"
#include "host/source/simulator/scenario.h"
#include "tests/bench/wrench_reference.h"

namespace tagwrench::bench {

/// Readings of the frames in which the target was held.
struct Readings {
  std::string name;
  std::vector<double> time;           ///< s of simulation time
  std::vector<Vector6> displacement;  ///< m, rad
  std::vector<Matrix6> covariance;    ///< of displacement; empty where the method claims none
  int frames = 0;                     ///< held or not
  double median_us = 0;               ///< processor time per frame; 0: not a method
};

/// All methods see the same `moving_frames` frames after the rest; the first entry is what the
/// frames show, read without any error.
std::vector<Readings> read_experiment(const sim::Scenario& scenario, int moving_frames);

/// The exponential filter of the paper's script, y += weight (x - y): on the three rotations alone,
/// as its data show.
Readings rotations_smoothed(Readings readings, double weight, std::string name);

study::Trial trial_of(const Readings& readings, const ReferenceRecord& reference);

}  // namespace tagwrench::bench
