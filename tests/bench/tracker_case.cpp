#include "tests/bench/tracker_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/source/simulator/simulator_source.h"
#include "tests/bench/tracker_bound.h"
#include "tests/bench/tracker_calibrated.h"

namespace tagwrench::bench {
namespace {

constexpr int kPoses = 6;
constexpr int kFramesEach = 50;

/// What the maker of the scenario knows and the owner of the sensor does not: where the tags are.
/// The rest pose is learned all the same, from the 25 frames, as displacement counts from there.
SensorConfig with_true_geometry(SensorConfig sensor, const sim::Scenario& scenario) {
  const std::vector<sim::PlacedTag> placed = sim::placed_tags(scenario);
  for (std::size_t t = 0; t < placed.size(); ++t) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = placed[t].platform_T_tag.rotation;
    pose.translation() = placed[t].platform_T_tag.position;
    sensor.target.tags[t].platform_T_tag = pose;
  }
  return sensor;
}

/// One method, its figures, and its place in the table.
struct Contender {
  std::string name;
  MotionScore motion;
  double first_us = 0;
  std::optional<Vector6> held_std;
};

std::vector<Contender> contenders(const Methods& methods, const Records& records) {
  std::vector<Contender> result;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    result.push_back(
        {methods[m]->name(), score_motion(records[m]), first_frame_us(records[m]), {}});
  }
  return result;
}

Methods make_methods(const Case& benched, const Clip& clip) {
  Methods methods;
  if (clip.opencv_knows_family) {
    methods.push_back(
        opencv_one_tag("(a) OpenCV unrefined, one tag, IPPE", clip.sensor, Corners::unrefined));
    methods.push_back(
        opencv_all_tags("(b) OpenCV subpixel, both tags", clip.sensor, Corners::subpixel));
    methods.push_back(
        opencv_all_tags("(c) OpenCV AprilTag corners, both tags", clip.sensor, Corners::apriltag));
  }
  methods.push_back(tagwrench_tracker("(e) tagwrench", clip.sensor));
  if (clip.known) methods.push_back(tagwrench_tracker("(e) geometry known", *clip.known));
  if (benched.calibrate)
    methods.push_back(
        tagwrench_tracker("(e) geometry calibrated", calibrated(clip.sensor, *clip.scenario)));
  return methods;
}

Methods april_methods(const Clip& clip) {
  Methods methods;
  methods.push_back(libapriltag("(d) libapriltag, own frames", clip.sensor));
  return methods;
}

const Contender* find(const std::vector<Contender>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Contender& c) { return c.name.starts_with(name); });
  return found == all.end() ? nullptr : &*found;
}

void add_std(const Methods& methods, const sim::Scenario& scenario,
             const std::vector<Vector6>& poses, std::vector<Contender>& all) {
  const Records held = run(*held_shots(scenario, poses, kFramesEach), methods);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    for (Contender& c : all) {
      if (c.name == methods[m]->name()) c.held_std = std_at_fixed_poses(held[m]);
    }
  }
}

void measure_fixed_poses(const Case& benched, const Record* records, std::size_t count,
                         std::vector<Contender>& all, Table& table) {
  std::vector<Vector6> poses;
  for (std::size_t p = 0; p < kPoses; ++p)
    poses.push_back(records[count - 1 - p * count / (kPoses + 2)].truth);
  add_std(make_methods(benched, benched.clip), *benched.clip.scenario, poses, all);
  if (benched.april) add_std(april_methods(*benched.april), *benched.april->scenario, poses, all);
  BoundOfScenario bound(*benched.clip.scenario);
  Vector6 mean_square = Vector6::Zero();
  int pixels = 0;
  for (const Vector6& pose : poses) {
    const Bound b = bound.at(pose);
    mean_square += b.sigma.cwiseAbs2() / kPoses;
    pixels = b.pixels;
  }
  const Vector6 sigma = mean_square.cwiseSqrt();
  table.columns(fmt::format("std at {} fixed poses x {} frames", kPoses, kFramesEach));
  for (const Contender& c : all) {
    if (c.held_std) table.row(c.name, *c.held_std);
  }
  table.row("Cramer-Rao bound", sigma);
  table.line(
      fmt::format("bound: {} pixels on the papers, gain and offset of each tag unknown, "
                  "before JPEG; steps x 0.6 change it by {:.1f} %",
                  pixels, 100 * bound.change_with_step(poses.front())));
  if (benched.targets.std_over_bound > 0) {
    table.target("(e) std, " + fmt::format("{:g} x bound", benched.targets.std_over_bound),
                 *find(all, "(e) tagwrench")->held_std, benched.targets.std_over_bound * sigma);
  }
}

void print_errors(const Case& benched, const std::vector<Contender>& all, Table& table) {
  const Targets& targets = benched.targets;
  const Contender& ours = *find(all, "(e) tagwrench");
  table.columns("RMS error after affine fit, second half");
  for (const Contender& c : all) table.row(c.name, c.motion.after_fit);
  if (targets.after_fit) table.target("(e) after fit", ours.motion.after_fit, *targets.after_fit);
  table.columns("RMS error, raw");
  for (const Contender& c : all) table.row(c.name, c.motion.raw);
  const Contender* known = find(all, "(e) geometry known");
  if (targets.absolute && known != nullptr)
    table.target("(e) geometry known, raw", known->motion.raw, *targets.absolute);
  if (const Contender* found = find(all, "(e) geometry calibrated")) {
    table.target("(e) geometry calibrated, raw", found->motion.raw,
                 limits(0.5, 1.5, INFINITY, INFINITY, INFINITY));
  }
}

void print_counts_and_times(const std::vector<Contender>& all, Table& table) {
  table.line(fmt::format("\n  {:<42}{:>9}{:>10}{:>11}{:>9}{:>10}{:>8}", "", "lost", "wrong ok",
                         "us median", "us p99", "us first", "nees"));
  for (const Contender& c : all) {
    const MotionScore& m = c.motion;
    table.line(fmt::format("{:<42}{:>9}{:>10}{:>11.0f}{:>9.0f}{:>10.0f}{:>8}", c.name,
                           fmt::format("{}/{}", m.lost, m.frames), m.wrong, m.median_us, m.p99_us,
                           c.first_us, m.nees > 0 ? fmt::format("{:.1f}", m.nees) : "-"));
  }
}

void print_gains(const Case& benched, const std::vector<Contender>& all, Table& table) {
  const Targets& targets = benched.targets;
  const MotionScore& ours = find(all, "(e) tagwrench")->motion;
  const Contender* a = find(all, "(a)");
  const Contender* b = find(all, "(b)");
  table.line("");
  if (a != nullptr && targets.z_gain_over_a > 0) {
    table.at_least("z error after fit, (a) / (e)", a->motion.after_fit[2] / ours.after_fit[2],
                   targets.z_gain_over_a, "times");
  }
  if (b != nullptr && targets.z_gain_over_b > 0) {
    table.at_least("z error after fit, (b) / (e)", b->motion.after_fit[2] / ours.after_fit[2],
                   targets.z_gain_over_b, "times");
  }
  if (b != nullptr && targets.speed_gain_over_b > 0) {
    table.at_least("median time, (b) / (e)", b->motion.median_us / ours.median_us,
                   targets.speed_gain_over_b, "times");
  }
  if (targets.p99_over_median > 0) {
    table.at_most("time of (e), p99 / median", ours.p99_us / ours.median_us,
                  targets.p99_over_median, "times");
  }
  if (benched.smaller) {
    Methods methods;
    methods.push_back(tagwrench_tracker("smaller", benched.smaller->sensor));
    const MotionScore smaller = score_motion(run(*benched.smaller->open(), methods).front());
    table.at_most("median time of (e) / its time at 640x480", ours.median_us / smaller.median_us,
                  targets.time_over_smaller, "times");
  }
  if (targets.found_again_ms > 0) {
    const std::unique_ptr<Method> method = tagwrench_tracker("found again", benched.clip.sensor);
    const double found_us = found_again_us(*benched.clip.open(), *method);
    table.at_most("time of (e) to find tags that were covered a frame ago", 1e-3 * found_us,
                  targets.found_again_ms, "ms");
  }
  table.at_most("wrong oks of (e)", ours.wrong, 0, "frames");
}

}  // namespace

Vector6 limits(double xy_um, double z_um, double rx_mrad, double ry_mrad, double rz_mrad) {
  Vector6 result;
  result << xy_um * 1e-6, xy_um * 1e-6, z_um * 1e-6, rx_mrad * 1e-3, ry_mrad * 1e-3, rz_mrad * 1e-3;
  return result;
}

Clip clip_of(const sim::Scenario& scenario, int moving_frames) {
  Clip clip;
  clip.sensor = parse_sensor(sim::sensor_yaml(scenario), "the benchmark's sensor");
  clip.known = with_true_geometry(clip.sensor, scenario);
  clip.scenario = scenario;
  clip.open = [scenario, moving_frames] { return moving_shots(scenario, moving_frames); };
  return clip;
}

void bench_case(const Case& benched, Table& table) {
  table.open(benched.name, benched.about);
  const Methods methods = make_methods(benched, benched.clip);
  const Records records = run(*benched.clip.open(), methods);
  std::vector<Contender> all = contenders(methods, records);
  if (benched.april) {
    const Methods april = april_methods(*benched.april);
    const Records own = run(*benched.april->open(), april);
    const auto place = std::find_if(all.begin(), all.end(),
                                    [](const Contender& c) { return c.name.starts_with("(e)"); });
    all.insert(place, contenders(april, own).front());
  }
  Vector6 largest = Vector6::Zero();
  for (const Record& r : records.front()) largest = largest.cwiseMax(r.truth.cwiseAbs());
  table.columns("frames");
  table.row("largest displacement", largest);
  print_errors(benched, all, table);
  if (benched.clip.scenario)
    measure_fixed_poses(benched, records.front().data(), records.front().size(), all, table);
  print_counts_and_times(all, table);
  print_gains(benched, all, table);
}

}  // namespace tagwrench::bench
