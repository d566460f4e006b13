#include "tests/bench/wrench_experiment.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "host/app/scenario_config.h"
#include "tests/bench/wrench_costs.h"
#include "tests/bench/wrench_scores.h"

namespace tagwrench::bench {
namespace {

constexpr double kPaperWeight = 0.2;
constexpr double kMinR2 = 0.999;
constexpr double kMinGainFz = 50;

enum Row : std::uint8_t { kTruth, kPaper, kUnfiltered, kBestOpenCv, kOurs };

std::vector<Scored> score_all(const std::vector<Readings>& readings,
                              const ReferenceRecord& reference) {
  std::vector<Scored> all;
  for (const Readings& r : readings) all.push_back(scored(r, reference));
  return all;
}

SixFigures ratio(const SixFigures& over, const SixFigures& under) {
  SixFigures result{};
  for (std::size_t axis = 0; axis < 6; ++axis) result[axis] = over[axis] / under[axis];
  return result;
}

/// What is left of `whole` without `part`, both RMS of independent errors.
SixFigures without(const SixFigures& whole, const SixFigures& part) {
  SixFigures result{};
  for (std::size_t axis = 0; axis < 6; ++axis)
    result[axis] = std::sqrt(std::max(0.0, whole[axis] * whole[axis] - part[axis] * part[axis]));
  return result;
}

void print_ratios(const std::vector<Scored>& all, Table& table) {
  table.columns("RMSE over that of (c)", kAxisHeads);
  table.figures("(a) the paper's pipeline / (c)", ratio(all[kPaper].rmse, all[kOurs].rmse), 1);
  table.figures("(a) without its filter / (c)", ratio(all[kUnfiltered].rmse, all[kOurs].rmse), 1);
  table.figures("(b) OpenCV's best / (c)", ratio(all[kBestOpenCv].rmse, all[kOurs].rmse), 1);
}

std::vector<Scored> with_ideal_reference(const std::vector<Readings>& readings,
                                         const ReferenceRecord& reference, Table& table) {
  table.open("ideal reference",
             {"the wrench that the hand applies, 1,000 times a second, without noise or lag"});
  const std::vector<Scored> all = score_all(readings, reference);
  print(all, table);
  print_ratios(all, table);

  table.columns("what limits (c): parts of its RMSE", kMilliHeads);
  table.figures("the platform's own dynamics, as in (t)", in_milli(all[kTruth].rmse), 4);
  table.figures("the tracker's error", in_milli(without(all[kOurs].rmse, all[kTruth].rmse)), 4);
  table.line("The reference tells what the hand applies, the springs feel it filtered by the mass");
  table.line("that they carry: a lag of its own for each mode, where the fit has one for all.");

  SixFigures limit{};
  limit.fill(kMinR2);
  table.columns("targets", kAxisHeads);
  table.figures("(c) held-out R^2", all[kOurs].r2, 6);
  table.at_least("(c) held-out R^2", all[kOurs].r2, limit, 6);
  table.at_least("Fz RMSE, (a) / (c)", all[kPaper].rmse[2] / all[kOurs].rmse[2], kMinGainFz,
                 "times");
  return all;
}

void with_optoforce(const std::vector<Readings>& readings, const sim::Scenario& scenario,
                    const ReferenceRecord& reference, Table& table) {
  table.open("OptoForce model",
             {"100 Hz, 15 Hz filter and transport of 40 ms together, whole counts, 1 count of "
              "noise;",
              "51 mm below the platform, torques about its own origin, as in the paper"});
  const std::vector<Scored> all = score_all(readings, reference);
  print(all, table);
  print_ratios(all, table);

  SixFigures noise{};
  Vector6::Map(noise.data()) = reference.noise;
  table.columns("how far the reference limits", kMilliHeads);
  table.figures("its noise and rounding, RMS", in_milli(noise), 4);
  table.figures("RMSE of (t): reference and dynamics alone", in_milli(all[kTruth].rmse), 4);
  table.figures("RMSE of (c)", in_milli(all[kOurs].rmse), 4);
  table.figures("(c) / (t)", ratio(all[kOurs].rmse, all[kTruth].rmse), 4);
  table.line("Between two readings of the reference, interpolation averages their noise. A lag");
  table.line("below zero: the reference is late.");
  table.columns("off from what was applied, held out", kMilliHeads);
  for (const Scored& s : all)
    table.figures(s.readings.name, in_milli(error_from_truth(s, scenario, reference)), 4);
}

}  // namespace

void bench_experiment(int moving_frames, Table& table) {
  const sim::Scenario scenario = load_scenario(TAGWRENCH_SCENARIOS "/paper.yaml");
  const double rate = scenario.camera.frame_rate;
  const double seconds = scenario.trajectory.rest_time + moving_frames / rate + 1;
  table.open("the paper's experiment, simulated",
             {fmt::format("{}x{}, f {:g} px, noise {:g} grey levels, JPEG quality {}, {:g} "
                          "frames/s, {} frames of compound motion",
                          scenario.camera.width_px, scenario.camera.height_px,
                          scenario.camera.fx_px, scenario.noise.read_counts,
                          scenario.compression.jpeg_quality, rate, moving_frames),
              "(t) is what the frames show, without error. (a) OpenCV's detection, corners",
              "unrefined, each tag's pose by IPPE, mean over both tags of translations and Euler",
              "angles, exponential filter of weight 0.2 on the angles; (b) sub-pixel corners, both",
              "tags as one body; (c) this project's tracker. All: affine fit, linear",
              "interpolation of the reference, one lag, five blocks in time held out in turn."});
  std::vector<Readings> readings = read_experiment(scenario, moving_frames);
  readings.insert(readings.begin() + kPaper,
                  rotations_smoothed(readings[kPaper], kPaperWeight, "(a) the paper's pipeline"));
  const ReferenceRecord ideal = ideal_reference(scenario, seconds);
  const std::vector<Scored> scores = with_ideal_reference(readings, ideal, table);
  with_optoforce(readings, scenario, optoforce_reference(scenario, seconds), table);
  bench_fit(readings[kOurs], ideal, scores[kOurs].analysis.lag.value, readings[kPaper].median_us,
            table);
}

}  // namespace tagwrench::bench
