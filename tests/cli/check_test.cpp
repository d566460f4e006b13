// `tagwrench check` and `tagwrench zero` as their users run them: a simulated sensor is calibrated,
// then something happens to it.
#include <gtest/gtest.h>

#include <regex>

#include "host/sensor/sensor_config.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

/// The default sensor and the one with a real one's faults, calibrated once for all tests.
class CalibratedSensor {
 public:
  CalibratedSensor(const std::string& scenario, int frames) : scenario_(scenario) {
    write_file(folder_ / "scenario.yaml", scenario);
    const Outcome sim = run_bridge({"sim", "--scenario", folder_ / "scenario.yaml", "--out",
                                    folder_ / "frames", "--frames", std::to_string(frames)});
    const Outcome target =
        run_bridge({"calibrate", "target", "--sensor", folder_ / "frames" / "sensor.yaml",
                    "--source", "images:" + (folder_ / "frames").string()});
    if (sim.status != 0 || target.status != 0) throw std::runtime_error(sim.err + target.err);
  }

  std::filesystem::path sensor() const { return folder_ / "frames" / "sensor.yaml"; }
  std::string yaml() const { return read_file(sensor()); }
  const std::string& scenario() const { return scenario_; }

  /// The sensor as calibrated, in another folder.
  std::filesystem::path copy_to(const TemporaryFolder& to) const {
    std::filesystem::copy(sensor(), to / "sensor.yaml");
    std::filesystem::copy(sensor().parent_path() / "measured", to / "measured");
    return to / "sensor.yaml";
  }

 private:
  TemporaryFolder folder_;
  std::string scenario_;
};

const std::string kDefault = "seed: 3\ntrajectory: {rest_s: 0.6}\n";
/// As scenarios/realistic.yaml.
const std::string kRealistic =
    "seed: 1\ncamera: {fx: 700, fy: 700}\n"
    "trajectory: {rest_s: 0.6, amplitude: [0.22, 0.2, 2.4, 0.004, 0.004, 0.003]}\n"
    "exposure: {time_ms: 1, even: true}\nnoise: {read_counts: 2, shot_counts_per_count: 0}\n"
    "compression: {jpeg_quality: 85}\n";

CalibratedSensor& default_sensor() {
  static CalibratedSensor sensor(kDefault, 90);
  return sensor;
}

CalibratedSensor& realistic_sensor() {
  static CalibratedSensor sensor(kRealistic, 150);
  return sensor;
}

/// The default roof, its lower tag moved along x, mm; the platform stays where it was.
std::string slipped(double dx_mm) {
  constexpr double kToRidge = 1.697056;  // mm
  std::string text = "target: {rest_position_mm: [";
  text += std::to_string(0.15 + dx_mm / 2) + ", -0.1, 21.0], tags: [{id: 5, position_mm: [0, " +
          std::to_string(-kToRidge) +
          ", 0], rotation_rad: [-0.785398163, 0, 0]}, {id: 2, position_mm: [" +
          std::to_string(dx_mm) + ", " + std::to_string(kToRidge) +
          ", 0], rotation_rad: [0.785398163, 0, 0]}]}\n";
  return text;
}

class Check : public testing::Test {
 protected:
  Outcome check(const CalibratedSensor& sensor, const std::string& change,
                const std::vector<std::string>& more = {}) {
    return check(sensor.sensor(), sensor.scenario() + change, more);
  }
  Outcome check(const std::filesystem::path& sensor, const std::string& scenario,
                const std::vector<std::string>& more = {}) {
    write_file(temporary_ / "now.yaml", scenario);
    std::vector<std::string> arguments = {"check", "--sensor", sensor, "--source",
                                          "sim:" + (temporary_ / "now.yaml").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }

  TemporaryFolder temporary_;
};

/// jsonl less the one number that tells of this machine.
std::string without_latency(const std::string& lines) {
  return std::regex_replace(lines, std::regex("\"latency_us\":[0-9]+"), "");
}

/// A line of standard output begins so.
bool says(const Outcome& outcome, const std::string& line) {
  return ("\n" + outcome.out).find("\n" + line) != std::string::npos;
}

TEST_F(Check, HealthySensorsAreFine) {
  for (const CalibratedSensor* sensor : {&default_sensor(), &realistic_sensor()}) {
    const Outcome outcome = check(*sensor, "");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_EQ(lines_in(outcome.out), 5u) << outcome.out;
    EXPECT_EQ(outcome.out.find("OFF"), std::string::npos) << outcome.out;
  }
}

TEST_F(Check, ATagThatSlippedIsNamedWithItsWay) {
  for (const CalibratedSensor* sensor : {&default_sensor(), &realistic_sensor()}) {
    const Outcome outcome = check(*sensor, slipped(0.012));
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_TRUE(says(outcome, "OFF    tags      tag 2 has moved by 1")) << outcome.out;
    EXPECT_NE(outcome.out.find("calibrate target"), std::string::npos);
    EXPECT_TRUE(says(outcome, "?      zero")) << outcome.out;
  }
  EXPECT_EQ(check(default_sensor(), slipped(0)).status, 0) << "the same places, spelt out";
}

TEST_F(Check, ALensThatTurnedIsToBeFocusedAgain) {
  for (const CalibratedSensor* sensor : {&default_sensor(), &realistic_sensor()}) {
    const Outcome outcome = check(*sensor, "optics: {focus_mm: 19.4}\n");
    EXPECT_EQ(outcome.status, 1) << outcome.out << outcome.err;
    EXPECT_TRUE(says(outcome, "OFF    focus")) << outcome.out;
    EXPECT_TRUE(says(outcome, "fine   tags")) << outcome.out;
  }
}

TEST_F(Check, LightThatIsTooDarkOrTooBrightIsSaid) {
  const Outcome dark = check(default_sensor(), "light: {level_counts: 90}\n");
  EXPECT_EQ(dark.status, 1);
  EXPECT_TRUE(says(dark, "OFF    light     too dark")) << dark.out;
  const Outcome bright = check(default_sensor(), "light: {level_counts: 400}\n");
  EXPECT_EQ(bright.status, 1);
  EXPECT_TRUE(says(bright, "OFF    light     too bright")) << bright.out;
}

TEST_F(Check, ASensorThatIsPressedOrStandsElsewhereIsNotCalledDrift) {
  const Outcome outcome =
      check(default_sensor(), "target: {rest_position_mm: [0.15, -0.1, 20.85]}\n");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_TRUE(says(outcome, "OFF    zero")) << outcome.out;
  EXPECT_NE(outcome.out.find("too far for drift"), std::string::npos) << outcome.out;
  EXPECT_TRUE(says(outcome, "fine   tags")) << outcome.out;
}

TEST_F(Check, AKnownMassTellsTheScale) {
  const std::vector<std::string> mass = {"--mass-g", "60", "--at", "5,3,0"};
  const Outcome fine = check(default_sensor(), "", mass);
  EXPECT_EQ(fine.status, 0) << fine.out << fine.err;
  EXPECT_TRUE(says(fine, "fine   scale")) << fine.out;
  // Springs that are 6 % softer than sensor.yaml says: the sensor reads too much.
  const Outcome soft = check(default_sensor(),
                             "mechanics: {axial_n_per_mm: 0.658, lateral_n_per_mm: 0.0658, "
                             "bending_nm_per_rad: 0.003036, torsion_nm_per_rad: 0.003487}\n",
                             mass);
  EXPECT_EQ(soft.status, 1) << soft.out;
  EXPECT_TRUE(says(soft, "OFF    scale     measured / known = 1.06")) << soft.out;
  // The person took another mass, of twice the weight.
  const Outcome heavier = check(default_sensor(), "bench: {faults: {wrong_mass: 1}}\n", mass);
  EXPECT_EQ(heavier.status, 1) << heavier.out;
  EXPECT_TRUE(says(heavier, "OFF    scale")) << heavier.out;
}

TEST_F(Check, CannotStartWithoutWhatItComparesWith) {
  const Outcome learned = check(default_sensor().sensor().parent_path() / "none.yaml", kDefault);
  EXPECT_EQ(learned.status, 2);
  write_file(temporary_ / "fresh.yaml", default_sensor().yaml());
  const Outcome fresh = check(temporary_ / "fresh.yaml", kDefault);
  EXPECT_EQ(fresh.status, 2);
  EXPECT_EQ(lines_in(fresh.err), 1u) << fresh.err;
  EXPECT_NE(fresh.err.find("calibrate target"), std::string::npos) << fresh.err;
  EXPECT_EQ(check(default_sensor(), "", {"--mass-g", "50"}).status, 2) << "without --at";
  EXPECT_EQ(check(default_sensor(), "", {"--mass-g", "50", "--at", "1,2"}).status, 2);
  EXPECT_EQ(
      check(default_sensor(), "", {"--mass-g", "50", "--at", "0,0,0", "--gravity", "0,0,0"}).status,
      2);
}

TEST_F(Check, NeverStillIsSaid) {
  const Outcome outcome =
      run_bridge({"check", "--sensor", default_sensor().sensor(), "--source",
                  "images:" + (default_sensor().sensor().parent_path()).string()});
  // A second and a bit at rest, then the hand: too little.
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("never stood still"), std::string::npos) << outcome.err;
}

class Zero : public Check {
 protected:
  Outcome zero(const std::filesystem::path& sensor, const std::string& scenario) {
    write_file(temporary_ / "now.yaml", scenario);
    return run_bridge(
        {"zero", "--sensor", sensor, "--source", "sim:" + (temporary_ / "now.yaml").string()});
  }
};

TEST_F(Zero, TakesOffWhatReadsWithHandsOff) {
  const std::filesystem::path sensor = default_sensor().copy_to(temporary_);
  // 40 um nearer: 0.11 N, 4.5 % of the range.
  const std::string drifted = kDefault + "target: {rest_position_mm: [0.15, -0.1, 20.96]}\n";
  const Outcome before = check(sensor, drifted);
  EXPECT_TRUE(says(before, "OFF    zero")) << before.out;
  const Outcome outcome = zero(sensor, drifted);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(read_file(sensor), default_sensor().yaml());
  const SensorConfig after = load_sensor(sensor);
  EXPECT_NEAR(after.zero.set[2], -0.112, 0.004);  // N: 2.8 N/mm
  EXPECT_EQ(after.zero.date.size(), 10u);
  EXPECT_EQ(check(sensor, drifted).status, 0);

  // And back again: the zero counts from the calibration, not from the last one.
  ASSERT_EQ(zero(sensor, kDefault).status, 0);
  EXPECT_NEAR(load_sensor(sensor).zero.set[2], 0, 2e-3);  // N
  EXPECT_TRUE(std::filesystem::exists(temporary_ / "measured" / "zero.yaml.before"));
}

TEST_F(Zero, RunTakesItOffToo) {
  const std::filesystem::path sensor = default_sensor().copy_to(temporary_);
  write_file(sensor, read_file(sensor) + "  zero_n: [0.1, 0, 0]\n  zero_nm: [0, 0, 0]\n");
  const auto fx = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "run",      "--fast", "--source", "sim:" + (temporary_ / "still.yaml").string(),
        "--sensor", sensor,   "--frames", "30",
        "--output", "jsonl:-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome run = run_bridge(arguments);
    EXPECT_EQ(run.status, 0) << run.err;
    const std::size_t at = run.out.rfind("\"f_n\":[");
    return at == std::string::npos ? 0.0 : std::stod(run.out.substr(at + 7));
  };
  write_file(temporary_ / "still.yaml", "seed: 3\ntrajectory: {motion: rest}\n");
  EXPECT_NEAR(fx({}), -0.1, 1e-3);                      // N
  EXPECT_NEAR(fx({"--no-zero-tracking"}), -0.1, 1e-3);  // N
}

TEST_F(Zero, RunFollowsADriftAndSaysSoUnlessToldNotTo) {
  const std::filesystem::path sensor = default_sensor().copy_to(temporary_);
  write_file(temporary_ / "still.yaml",
             "seed: 3\ntrajectory: {motion: rest}\ntarget: {rest_position_mm: [0.15, -0.1, "
             "20.99]}\n");
  const auto run = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "run",      "--fast", "--source", "sim:" + (temporary_ / "still.yaml").string(),
        "--sensor", sensor,   "--frames", "130",
        "--output", "jsonl:-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  };
  const Outcome first = run({});
  EXPECT_NE(first.err.find("the zero followed"), std::string::npos) << first.err;
  EXPECT_TRUE(without_latency(first.out) == without_latency(run({}).out))
      << "the same frames, other bytes";
  EXPECT_EQ(run({"--no-zero-tracking"}).err.find("the zero followed"), std::string::npos);
  write_file(sensor, read_file(sensor) + "  zero_tracking: false\n");
  EXPECT_EQ(run({}).err.find("the zero followed"), std::string::npos);
}

TEST_F(Zero, RefusesAFaultThatIsNoDriftAndWritesNothing) {
  const std::filesystem::path sensor = default_sensor().copy_to(temporary_);
  const std::string before = read_file(sensor);
  const auto refused = [&](const std::string& scenario, const std::string& why) {
    const Outcome outcome = zero(sensor, scenario);
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("nothing was written"), std::string::npos) << outcome.err;
    EXPECT_EQ(read_file(sensor), before);
    EXPECT_FALSE(std::filesystem::exists(temporary_ / "measured" / "zero.yaml"));
  };
  refused(kDefault + "target: {rest_position_mm: [0.15, -0.1, 20.8]}\n", "too far for drift");
  refused(kDefault + slipped(0.03), "tag 2 has moved");
  const Outcome missing = zero(temporary_ / "none.yaml", kDefault);
  EXPECT_EQ(missing.status, 2);
}

TEST_F(Zero, ANewTargetCalibrationVoidsIt) {
  const std::filesystem::path sensor = default_sensor().copy_to(temporary_);
  const auto calibrate = [&] {
    const Outcome target =
        run_bridge({"calibrate", "target", "--sensor", sensor, "--source",
                    "images:" + default_sensor().sensor().parent_path().string()});
    ASSERT_EQ(target.status, 0) << target.err;
  };
  ASSERT_EQ(zero(sensor, kDefault + "target: {rest_position_mm: [0.15, -0.1, 20.96]}\n").status, 0);
  ASSERT_FALSE(load_sensor(sensor).zero.set.isZero());
  calibrate();
  EXPECT_TRUE(load_sensor(sensor).zero.set.isZero());
  EXPECT_EQ(load_sensor(sensor).zero.date, "");
  EXPECT_TRUE(std::filesystem::exists(temporary_ / "measured" / "zero.yaml.before"));

  // One that stands in sensor.yaml, where no command writes, is overruled.
  const std::string old = read_file(sensor) +
                          "  zero_n: [0.1, 0, 0]\n  zero_nm: [0, 0, 0]\n  zero_date: "
                          "'2026-01-02'\n";
  write_file(sensor, old);
  ASSERT_FALSE(load_sensor(sensor).zero.set.isZero());
  calibrate();
  EXPECT_TRUE(load_sensor(sensor).zero.set.isZero());
  EXPECT_EQ(read_file(sensor), old);
  std::filesystem::remove(temporary_ / "measured" / "zero.yaml");
  EXPECT_FALSE(load_sensor(sensor).zero.set.isZero()) << "back to sensor.yaml's";
}

}  // namespace
}  // namespace tagwrench::test
