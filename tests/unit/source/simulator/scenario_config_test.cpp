#include "host/app/scenario_config.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "host/core/config_error.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {
namespace {

std::string complaint(const std::string& text) {
  try {
    parse_scenario(text, "s.yaml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ScenarioConfig, EveryFileOfTheCollectionLoads) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(TAGWRENCH_SCENARIOS)) {
    EXPECT_NO_THROW(load_scenario(entry.path().string())) << entry.path();
    ++files;
  }
  EXPECT_GT(files, 10);
}

TEST(ScenarioConfig, ValuesAreConvertedToSi) {
  const sim::Scenario s = parse_scenario(
      "seed: 9\n"
      "mechanics: {mass_g: 12, axial_n_per_mm: 0.9, range: [1, 2, 3, 4, 5, 6]}\n"
      "target: {tag_size_mm: 4, rest_position_mm: [0.5, 0, 22]}\n"
      "exposure: {time_ms: 2}\n"
      "trajectory: {motion: push, axis: mz, share: -0.5, hold_s: 2}\n",
      "s.yaml");
  EXPECT_EQ(s.seed, 9U);
  EXPECT_DOUBLE_EQ(s.mechanics.mass, 0.012);
  EXPECT_DOUBLE_EQ(s.mechanics.axial_stiffness, 900);
  EXPECT_DOUBLE_EQ(s.mechanics.range[5], 6);
  EXPECT_DOUBLE_EQ(s.target.tag_size, 4e-3);
  EXPECT_DOUBLE_EQ(s.target.rest_position.z(), 22e-3);
  EXPECT_DOUBLE_EQ(s.exposure.time, 2e-3);
  EXPECT_EQ(s.trajectory.motion, sim::Motion::push);
  EXPECT_EQ(s.trajectory.axis, 5);
  EXPECT_DOUBLE_EQ(s.trajectory.share, -0.5);
  EXPECT_DOUBLE_EQ(s.camera.fx_px, 805);  // untouched
}

TEST(ScenarioConfig, DisturbancesAreListsOfTheirKinds) {
  const sim::Scenario s = parse_scenario(
      "exposure: {even: true}\n"
      "trajectory: {motion: hard, event_s: 3}\n"
      "disturbances:\n"
      "  occluders: [{shape: disc, width_px: 80, aim_px: [3, -4], start_s: 5, length_s: 2}]\n"
      "  glare: [{peak_counts: 90}, {sigma_px: 12, fade_s: 0.5}]\n"
      "  light: [{factor: 0, every_s: 7}]\n"
      "  flicker: [{depth: 0.2, mains_hz: 60}]\n"
      "  turning_light: [{turn_s: 9}]\n"
      "  dirt: [{tag: 1, specks: 2, scratches: 3, size_mm: 0.1}]\n"
      "  focus: [{shift_mm: -2, hunt_hz: 3}]\n"
      "  lost_frames: {share: 0.1, most_in_a_row: 4}\n"
      "  random: {start_s: 8, every_s: 4}\n",
      "s.yaml");
  const sim::Disturbances& d = s.disturbances;
  EXPECT_TRUE(s.exposure.even);
  EXPECT_EQ(s.trajectory.motion, sim::Motion::hard);
  EXPECT_EQ(s.trajectory.event_time, 3);
  ASSERT_EQ(d.occluders.size(), 1U);
  EXPECT_EQ(d.occluders[0].shape, sim::OccluderShape::disc);
  EXPECT_EQ(d.occluders[0].aim_px, Eigen::Vector2d(3, -4));
  EXPECT_EQ(d.occluders[0].when.start, 5);
  EXPECT_EQ(d.occluders[0].when.length, 2);
  ASSERT_EQ(d.glare.size(), 2U);
  EXPECT_EQ(d.glare[1].sigma_px, 12);
  EXPECT_EQ(d.light.at(0).when.every, 7);
  EXPECT_EQ(d.flicker.at(0).mains_hz, 60);
  EXPECT_EQ(d.turning_light.at(0).turn, 9);
  EXPECT_DOUBLE_EQ(d.dirt.at(0).size, 0.1e-3);
  EXPECT_DOUBLE_EQ(d.focus.at(0).shift, -2e-3);
  EXPECT_EQ(d.lost_frames.most_in_a_row, 4);
  EXPECT_EQ(d.random.start, 8);
}

TEST(ScenarioConfig, ImpossibleDisturbancesNameFileLineAndKey) {
  const std::string head = "seed: 1\ndisturbances:\n";
  EXPECT_EQ(complaint(head + "  glare: [{radius: 3}]\n").rfind("s.yaml:3: disturbances.glare", 0),
            0U);
  EXPECT_EQ(complaint(head + "  dirt: [{tag: 2}]\n").rfind("s.yaml:3: disturbances.dirt", 0), 0U);
  EXPECT_EQ(complaint(head + "  light: [{length_s: 3, every_s: 1}]\n")
                .rfind("s.yaml:3: disturbances.light: ", 0),
            0U);
  EXPECT_NE(complaint(head + "  flicker: [{depth: 2}]\n").find("depth must lie between 0 and 1"),
            std::string::npos);
  EXPECT_EQ(complaint(head + "  random: {every_s: 2}\n").rfind("s.yaml:3: disturbances.random", 0),
            0U);
  EXPECT_NE(complaint(head + "  lost_frames: {share: 0.9}\n"), "accepted");
}

TEST(ScenarioConfig, TheBenchIsReadAndCheckedSectionBySection) {
  const sim::Scenario s = parse_scenario(
      "mechanics: {creep_share: 0.02, creep_s: 30, friction: 0.01, friction_travel: 0.2}\n"
      "bench:\n"
      "  gravity: 9.81\n"
      "  errors: {mass_percent: 0.5, point_mm: 0.3, gravity_rad: 0.01}\n"
      "  times: {swing_decay_s: 2, string_mm: 200}\n"
      "  faults: {wrong_mass: 3, wrong_mass_factor: 1.5, bump: 4, slip: 5, slip_tag: 1,\n"
      "           slip_change: [1.0e-4, 0, 0.02], drift_per_hour: [1.0e-6, 0, 0, 0, 0, 0]}\n"
      "  load_cell: {noise_mn: 1, lag_ms: 20, wrong_sign: true, silent_from_s: 5}\n"
      "  six_axis: {ideal: true, origin_mm: [0, 0, -60], clock_ppm: 50}\n",
      "s.yaml");
  const sim::BenchSettings& bench = s.bench;
  EXPECT_EQ(s.mechanics.creep_share, 0.02);
  EXPECT_EQ(s.mechanics.friction_travel, 0.2);
  EXPECT_FALSE(bench.perfect);
  EXPECT_EQ(bench.gravity, 9.81);
  EXPECT_DOUBLE_EQ(bench.errors.mass, 0.005);
  EXPECT_DOUBLE_EQ(bench.errors.point, 0.3e-3);
  EXPECT_DOUBLE_EQ(bench.times.string_length, 0.2);
  EXPECT_EQ(bench.faults.wrong_mass, 3);
  EXPECT_EQ(bench.faults.slip_tag, 1);
  EXPECT_EQ(bench.faults.slip_change, Eigen::Vector3d(1e-4, 0, 0.02));
  EXPECT_EQ(bench.faults.drift_per_hour[0], 1e-6);
  EXPECT_DOUBLE_EQ(bench.load_cell.noise, 1e-3);
  EXPECT_TRUE(bench.load_cell.faults.wrong_sign);
  EXPECT_EQ(bench.load_cell.faults.silent_from, 5);
  EXPECT_TRUE(bench.six_axis.ideal);
  EXPECT_DOUBLE_EQ(bench.six_axis.origin.z(), -0.06);
  EXPECT_EQ(bench.six_axis.faults.clock_ppm, 50);
  EXPECT_EQ(parse_scenario("bench: {perfect: true}\n", "s.yaml").bench.perfect, true);

  const auto begins = [](const std::string& bench_lines, const std::string& begin) {
    const std::string text = complaint("seed: 1\nbench:\n" + bench_lines);
    EXPECT_EQ(text.rfind("s.yaml:3: bench." + begin, 0), 0U) << text;
  };
  begins("  gravity: 0\n", "gravity");
  begins("  errors: {mass_percent: -1}\n", "errors: bench.errors: mass_percent must lie");
  begins("  errors: {masses: 1}\n", "errors.masses");
  begins("  times: {load_s: 0}\n", "times: ");
  begins("  faults: {slip_tag: 2}\n", "faults: ");
  begins("  faults: {bump: -1}\n", "faults.bump");
  begins("  load_cell: {rate_hz: 0}\n", "load_cell: ");
  begins("  load_cell: {silent_from_s: 5, silent_to_s: 4}\n", "load_cell: ");
  begins("  six_axis: {counts_per_unit: [1, 2, 3, 4, 5, 0]}\n", "six_axis: ");
  begins("  six_axis: {range: [1, 2]}\n", "six_axis.range");
  EXPECT_NE(complaint("mechanics: {creep_share: 2}\n"), "accepted");
}

TEST(ScenarioConfig, OneTagLiesOnASlopeThroughTheOrigin) {
  const sim::Scenario s = parse_scenario("target: {tags: [{id: 7}]}\n", "s.yaml");
  ASSERT_EQ(s.target.tags.size(), 1U);
  EXPECT_EQ(s.target.tags[0].id, 7);
  EXPECT_EQ(s.target.tags[0].position, Eigen::Vector3d(0, 0, 0));
  EXPECT_LT(s.target.tags[0].rotation.x(), -0.5);
}

TEST(ScenarioConfig, UnknownKeysNameFileLineAndKey) {
  const std::string text = complaint("seed: 1\ncamera:\n  fx: 805\n  focal: 3\n");
  EXPECT_EQ(text.rfind("s.yaml:4: camera.focal", 0), 0U) << text;
}

TEST(ScenarioConfig, ImpossibleValuesNameFileLineAndKey) {
  EXPECT_EQ(complaint("mechanics:\n  mass_g: -3\n").rfind("s.yaml:2: mechanics.mass_g", 0), 0U);
  EXPECT_EQ(
      complaint("seed: 1\ntarget:\n  tag_size_mm: 0\n").rfind("s.yaml:3: target.tag_size_mm", 0),
      0U);
  EXPECT_EQ(complaint("camera: {fx: .nan}\n").rfind("s.yaml:1: camera.fx", 0), 0U);
  EXPECT_EQ(complaint("camera: {fps: 0}\n").rfind("s.yaml:1: camera.fps", 0), 0U);
  EXPECT_EQ(complaint("target: {family: qr}\n").rfind("s.yaml:1: target.family", 0), 0U);
  EXPECT_EQ(complaint("target: {tags: [{id: 5}, {id: 5}]}\n").rfind("s.yaml:1: target.tags", 0),
            0U);
  EXPECT_EQ(complaint("target: {family: apriltag_16h5, tags: [{id: 30}]}\n")
                .rfind("s.yaml:1: target.tags", 0),
            0U);
  EXPECT_EQ(complaint("exposure: {time_ms: 50}\n").rfind("s.yaml:1: exposure", 0), 0U);
  EXPECT_EQ(complaint("trajectory: {motion: jump}\n").rfind("s.yaml:1: trajectory.motion", 0), 0U);
  EXPECT_EQ(complaint("seed: 1\n"), "accepted");
}

TEST(ScenarioConfig, ALensThatFoldsTheImageOverIsRefused) {
  const sim::Scenario s = parse_scenario("camera: {distortion: [-3, 0, 0, 0, 0]}\n", "s.yaml");
  EXPECT_THROW(SimulatorSource(s, false), ConfigError);
}

}  // namespace
}  // namespace tagwrench
