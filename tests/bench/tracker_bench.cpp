// The honest table: the usual ways to track tags and this project's, on the same frames in the same
// run, beside the Cramer-Rao bound and the targets. Standard output carries the table.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/source/simulator/prints.h"
#include "tests/bench/tracker_case.h"
#include "tests/support/hard_run.h"

namespace tagwrench::bench {
namespace {

constexpr const char* kGrid = "grid_10x10";

sim::Scenario scenario_named(const std::string& name) {
  return load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/" + name + ".yaml");
}

std::string described(const sim::Scenario& s) {
  return fmt::format("{}x{}, f {:g} px, noise {:g} grey levels, {:g} frames/s, {} frames at rest",
                     s.camera.width_px, s.camera.height_px, s.camera.fx_px, s.noise.read_counts,
                     s.camera.frame_rate, kRestFrames);
}

sim::Scenario with_april_tags(sim::Scenario scenario) {
  scenario.target.family = "apriltag_36h11";
  return scenario;
}

Targets targets_of_every_case() {
  Targets targets;
  targets.speed_gain_over_b = 20;
  targets.p99_over_median = 2;
  return targets;
}

Case simulated(const std::string& name, const std::string& what, const sim::Scenario& scenario) {
  Case result;
  result.name = name;
  result.about = {what, described(scenario)};
  result.clip = clip_of(scenario, kMovingFrames);
  result.april = clip_of(with_april_tags(scenario), kMovingFrames);
  result.targets = targets_of_every_case();
  result.targets.absolute = limits(0.15, 0.6, INFINITY, INFINITY, INFINITY);
  result.targets.std_over_bound = 1.2;
  result.targets.found_again_ms = 3;
  result.calibrate = true;
  return result;
}

void clean(Table& table) {
  Case c = simulated("clean", "exact print, even light, ideal lens", scenario_named("clean"));
  c.targets.after_fit = limits(0.05, 0.4, 0.04, 0.08, 0.025);
  c.targets.z_gain_over_a = 150;
  c.targets.z_gain_over_b = 8;
  bench_case(c, table);
}

void realistic(Table& table, bool jpeg) {
  sim::Scenario scenario = scenario_named("realistic");
  if (!jpeg) scenario.compression.jpeg_quality = 0;
  Case c = simulated(jpeg ? "jpeg85" : "realistic",
                     std::string("ragged paper, spread ink, uneven light, distortion, defocus") +
                         (jpeg ? ", JPEG quality 85" : ""),
                     scenario);
  c.targets.after_fit = limits(0.15, 0.4, 0.05, 0.08, 0.03);
  c.targets.z_gain_over_b = 10;
  bench_case(c, table);
}

/// Trouble that the bound does not know and no calibration takes away: only what must never happen
/// is a target.
Case troubled(const std::string& name, const std::string& what) {
  Case c = simulated(name, what, scenario_named(name));
  c.calibrate = false;
  c.targets.absolute = {};
  c.targets.std_over_bound = 0;
  return c;
}

void webcam_cheap(Table& table) {
  Case c = troubled("webcam_cheap",
                    "long exposure, smoothing, sharpening, hunting exposure, JPEG quality 70");
  c.targets.speed_gain_over_b = 15;
  bench_case(c, table);
}

void motion_blur(Table& table) {
  Case c = troubled("motion_blur", "an exposure of 25 ms, pushed about at up to 6 Hz");
  c.april.reset();
  c.targets.speed_gain_over_b = 0;
  c.targets.p99_over_median = 0;
  c.targets.found_again_ms = 0;  // most frames are lost for good reason
  bench_case(c, table);
}

void full_hd(Table& table) {
  constexpr int kFrames = 100;
  const sim::Scenario small = scenario_named("clean");
  sim::Scenario scenario = small;
  scenario.camera.width_px = 1920;
  scenario.camera.height_px = 1080;
  scenario.camera.cx_px = 959.5;
  scenario.camera.cy_px = 539.5;
  Case c;
  c.name = "full_hd";
  c.about = {"as clean, on a larger sensor: the tags are as many pixels wide", described(scenario)};
  c.clip = clip_of(scenario, kFrames);
  c.clip.scenario.reset();  // fixed poses and the bound are those of clean
  c.clip.known.reset();
  c.smaller = clip_of(small, kFrames);
  c.targets = targets_of_every_case();
  c.targets.time_over_smaller = 1.2;
  c.targets.found_again_ms = 8;
  bench_case(c, table);
}

void grid(Table& table) {
  if (!sim::family_exists(kGrid)) {
    table.skipped("grid", std::string("the simulator does not print ") + kGrid);
    return;
  }
  sim::Scenario scenario = scenario_named("clean");
  scenario.target.family = kGrid;
  Case c = simulated("grid", "as clean, but with the high-information tags; compare the bounds",
                     scenario);
  c.clip.opencv_knows_family = false;
  c.april.reset();
  c.calibrate = false;
  c.targets.speed_gain_over_b = 0;
  bench_case(c, table);
}

void semi_real(Table& table) {
  const std::optional<Clip> clip = semi_real_clip(kMovingFrames);
  if (!clip) {
    table.skipped("semi_real",
                  "TAGWRENCH_DATA does not name the folder with the real recording (icra2020/)");
    return;
  }
  Case c;
  c.name = "semi_real";
  c.about = {"the real picture, its tags' planes moved: real ink, light, blur, JPEG blocks",
             "640x480, f 805 px, 2 grey levels of noise added to every frame, 25 frames/s"};
  c.clip = *clip;
  c.targets = targets_of_every_case();
  c.targets.after_fit = limits(0.15, 0.6, INFINITY, INFINITY, INFINITY);
  c.targets.z_gain_over_b = 50;
  bench_case(c, table);
}

void hard(Table& table) {
  const int frames = test::hard_frames(10'000);
  table.open("hard",
             {fmt::format("occlusion, glare, light steps, taps, drops: {} frames", frames)});
  const test::HardRun run = test::run_hard(scenario_named("hard"), frames);
  fmt::print("{}", test::report(run, 5));
  table.at_most("wrong oks of (e)", static_cast<double>(run.wrong.size()), 0, "frames");
  table.at_most("slowest recovery", run.slowest_recovery, 2, "frames");
}

struct NamedCase {
  const char* name;
  std::function<void(Table&)> bench;
};

const std::vector<NamedCase>& cases() {
  static const std::vector<NamedCase> all = {
      {"clean", clean},
      {"realistic", [](Table& t) { realistic(t, false); }},
      {"jpeg85", [](Table& t) { realistic(t, true); }},
      {"webcam_cheap", webcam_cheap},
      {"motion_blur", motion_blur},
      {"full_hd", full_hd},
      {"semi_real", semi_real},
      {"grid", grid},
      {"hard", hard},
  };
  return all;
}

bool asked_for(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

/// Empty, or why this cannot be run.
std::string problem(const std::vector<std::string>& names) {
  std::string known;
  for (const NamedCase& c : cases()) known += std::string(known.empty() ? "" : ", ") + c.name;
  for (const std::string& name : names) {
    const auto same = [&](const NamedCase& c) { return c.name == name; };
    if (std::none_of(cases().begin(), cases().end(), same))
      return fmt::format("no case '{}'; choose among {}", name, known);
  }
  return {};
}

void bench(const std::vector<std::string>& names) {
  Table table;
  fmt::print(
      "Every method sees the same frames in the same run, one thread; times are processor time of\n"
      "the thread per frame, after the target was found (us first: the frame in which it is).\n"
      "(d) needs other tags and sees its own frames of the same motion. nees: mean of error'\n"
      "covariance^-1 error, 6 when the covariance is true. Wrong ok: off by more than 50 um "
      "across,\n"
      "150 um in depth or 10 mrad; the hard case has a finer rule (tests/support/hard_run.h).\n");
  for (const NamedCase& c : cases()) {
    if (asked_for(names, c.name)) c.bench(table);
  }
  table.close();
}

}  // namespace
}  // namespace tagwrench::bench

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  const std::vector<std::string> names(argv + 1, argv + argc);
  if (const std::string wrong = tagwrench::bench::problem(names); !wrong.empty()) {
    fmt::print(stderr, "bench tracker: {}\n", wrong);
    return 2;
  }
  try {
    tagwrench::bench::bench(names);
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench tracker: {}\n", e.what());
    return 1;
  }
}
