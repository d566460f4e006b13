// One case of the tracker's benchmark: frames, targets, the comparison.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "host/source/simulator/scenario.h"
#include "tests/bench/table.h"
#include "tests/bench/tracker_run.h"

namespace tagwrench::bench {

struct Targets {
  std::optional<Vector6> after_fit;  ///< m, rad
  std::optional<Vector6> absolute;   ///< raw error, geometry known, m, rad
  double z_gain_over_a = 0;          ///< least ratio of z errors after fit; 0: none
  double z_gain_over_b = 0;
  double speed_gain_over_b = 0;
  double p99_over_median = 0;
  double std_over_bound = 0;
  double time_over_smaller = 0;
  double found_again_ms = 0;
};

/// Six limits from x = y, z in um and three rotations in mrad.
Vector6 limits(double xy_um, double z_um, double rx_mrad, double ry_mrad, double rz_mrad);

struct Clip {
  SensorConfig sensor;                                ///< as its owner knows it
  std::optional<SensorConfig> known;                  ///< with the true geometry
  std::function<std::unique_ptr<ShotSource>()> open;  ///< the moving frames
  std::optional<sim::Scenario> scenario;              ///< for fixed poses and the bound
  bool opencv_knows_family = true;
};

struct Case {
  std::string name;
  std::vector<std::string> about;
  Clip clip;
  std::optional<Clip> april;    ///< the same motion with AprilTags
  std::optional<Clip> smaller;  ///< whose time must not be much less
  bool calibrate = false;       ///< also with geometry calibrated from another recording
  Targets targets;
};

constexpr int kMovingFrames = 300;

Clip clip_of(const sim::Scenario& scenario, int moving_frames);

/// The real picture, moved (tests/support/semi_real.h); empty without TAGWRENCH_DATA.
std::optional<Clip> semi_real_clip(int moving_frames);

void bench_case(const Case& benched, Table& table);

}  // namespace tagwrench::bench
