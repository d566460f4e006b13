// `tagwrench calibrate wrench` as its users run it, on the simulated bench.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/sensor/sensor_config.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

using nlohmann::json;

// A small picture, so that a calibration takes seconds.
const char* const kScenario = R"(seed: 3
camera: {width: 320, height: 240, fx: 402.5, fy: 402.5, cx: 159.5, cy: 119.5}
optics: {psf_sigma_px: 0.6}
)";

// Three loads along x and two of the three torques: what they do not reach is completed.
const char* const kShortPlan = R"(about: short
reference: masses
points:
  - {name: right, position_mm: [15, 0, 6]}
  - {name: left, position_mm: [-15, 0, 6]}
  - {name: lower, position_mm: [0, 15, 6]}
mountings:
  - name: standing
    gravity: [0, 0, -1]
    say: stand it up
    steps:
      - {do: rest}
      - {do: mass, mass_g: 50, at: right}
      - {do: mass, mass_g: 50, at: left}
      - {do: mass, mass_g: 50, at: lower}
      - {do: rest}
)";

// Three short pushes, from two sides and above.
const char* const kCellPlan = R"(about: short
reference: load_cell
points:
  - {name: right, position_mm: [15, 0, 6]}
  - {name: lower, position_mm: [0, 15, 6]}
  - {name: top, position_mm: [0, 0, 6]}
mountings:
  - name: standing
    gravity: [0, 0, -1]
    say: stand it up
    steps:
      - {do: rest}
      - {do: push, at: right, along: [-1, 0, 0], up_to_n: 0.7, seconds: 3}
      - {do: push, at: lower, along: [0, -1, 0], up_to_n: 0.7, seconds: 3}
      - {do: push, at: top, along: [0, 0, -1], up_to_n: 0.7, seconds: 3}
      - {do: rest}
)";

// Five axes: what hangs on the sides hangs in the middle.
const char* const kUntwistedPlan = R"(about: no twist
reference: masses
points:
  - {name: middle, position_mm: [0, 0, 6]}
  - {name: right, position_mm: [15, 0, 6]}
  - {name: lower, position_mm: [0, 15, 6]}
mountings:
  - name: standing
    gravity: [0, 0, -1]
    say: stand it up
    steps:
      - {do: rest}
      - {do: mass, mass_g: 50, at: right}
      - {do: mass, mass_g: 50, at: lower}
      - {do: mass, mass_g: 50, at: middle}
      - {do: rest}
  - name: on its right side
    gravity: [1, 0, 0]
    say: lay it down
    steps:
      - {do: rest}
      - {do: mass, mass_g: 50, at: middle}
      - {do: rest}
  - name: on its lower side
    gravity: [0, 1, 0]
    say: lay it down
    steps:
      - {do: rest}
      - {do: mass, mass_g: 50, at: middle}
      - {do: rest}
)";

class CalibrateWrench : public testing::Test {
 protected:
  void SetUp() override {
    write_file(scenario_, kScenario);
    const std::string frames = (temporary_ / "frames").string();
    ASSERT_EQ(run_bridge({"sim", "--scenario", scenario_, "--out", frames, "--frames", "1"}).status,
              0);
    std::string sensor = read_file(temporary_ / "frames" / "sensor.yaml");
    replace(sensor, "axial_n_per_mm: 0.7", "axial_n_per_mm: 0.8");  // as roughly as people know it
    write_file(sensor_, "# mine\n" + sensor);
    write_file(plan_, kShortPlan);
    before_ = read_file(sensor_);
  }
  static void replace(std::string& text, const std::string& old, const std::string& fresh) {
    ASSERT_NE(text.find(old), std::string::npos) << old;
    text.replace(text.find(old), old.size(), fresh);
  }
  Outcome calibrate(const std::string& plan, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"calibrate", "wrench",   "--sensor",
                                          sensor_,     "--source", "sim:" + scenario_.string(),
                                          "--plan",    plan};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }
  void faults(const std::string& text) {
    write_file(scenario_, std::string(kScenario) + "bench: {faults: {" + text + "}}\n");
  }
  void expect_refused(const Outcome& outcome, const std::string& part, int status = 2) {
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(part), std::string::npos)
        << "no '" << part << "' in " << outcome.err;
    EXPECT_EQ(read_file(sensor_), before_) << "the old calibration stays in force";
    EXPECT_FALSE(std::filesystem::exists(out_));
  }

  Outcome recalibrate(const std::string& recording, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"calibrate", "wrench",   "--sensor",
                                          sensor_,     "--source", "recording:" + recording};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }
  /// Where there is a calibration already.
  void expect_refused_again(const Outcome& outcome, const std::string& part) {
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos)
        << "no '" << part << "' in " << outcome.err;
  }
  static void expect_same_newtons(const json& first, const json& second) {
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) {
        const double k = first.at("K")[i][j];
        EXPECT_NEAR(second.at("K")[i][j].get<double>(), k, 1e-9 * std::abs(k)) << i << ' ' << j;
      }
    }
    EXPECT_EQ(second.at("axes"), first.at("axes"));
  }

  TemporaryFolder temporary_;
  std::filesystem::path scenario_ = temporary_ / "scenario.yaml";
  std::filesystem::path sensor_ = temporary_ / "sensor.yaml";
  std::filesystem::path plan_ = temporary_ / "plan.yaml";
  std::filesystem::path out_ = temporary_ / "measured" / "wrench.json";
  std::filesystem::path partial_ = temporary_ / "measured" / "wrench.json.partial";
  std::string before_;
};

TEST_F(CalibrateWrench, OneKitchenWeightCalibratesAllSixAxesAndRunUsesIt) {
  const Outcome outcome = calibrate("six_orientations");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  const json calibration = json::parse(read_file(out_));
  for (const json& axis : calibration.at("axes")) EXPECT_EQ(axis.at("state"), "calibrated");
  EXPECT_EQ(calibration.at("plan"), "six_orientations");
  EXPECT_NEAR(calibration.at("K")[2][2].get<double>(), 2800, 40);  // N/m, described as 3200
  EXPECT_TRUE(std::filesystem::exists(temporary_ / "measured" / "wrench.data.csv"));
  EXPECT_FALSE(std::filesystem::exists(partial_));

  EXPECT_EQ(read_file(sensor_), before_);
  const SensorConfig sensor = load_sensor(sensor_);
  EXPECT_NEAR(sensor.wrench.K(2, 2), 2800, 40);
  EXPECT_TRUE(sensor.spring_stiffness);
  const Outcome run =
      run_bridge({"run", "--sensor", sensor_, "--source", "sim:" + scenario_.string(), "--fast",
                  "--frames", "60", "--output", "jsonl:-"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("\"status\":\"ok\""), std::string::npos);
  EXPECT_NE(run.err.find("wrench: measured/wrench.json, of 2"), std::string::npos) << run.err;
  std::filesystem::remove(out_);
  EXPECT_NEAR(load_sensor(sensor_).wrench.K(2, 2), 3200, 1e-6) << "as the springs are described";
}

TEST_F(CalibrateWrench, ElsewhereItIsInForceWhenSensorYamlNamesIt) {
  const std::string elsewhere = (temporary_ / "elsewhere.json").string();
  const Outcome first = calibrate(plan_, {"--out", elsewhere});
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_NE(first.err.find("it is in force as soon as it is"), std::string::npos) << first.err;
  EXPECT_EQ(read_file(sensor_), before_);
  EXPECT_EQ(load_sensor(sensor_).calibration, "");
  std::string naming = before_;
  replace(naming, "wrench:\n", "wrench:\n  calibration: elsewhere.json\n");
  write_file(sensor_, naming);
  EXPECT_EQ(load_sensor(sensor_).calibration, elsewhere);
  const Outcome second = calibrate(plan_, {"--out", elsewhere});
  ASSERT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(second.err.find("as soon as"), std::string::npos) << second.err;
}

TEST_F(CalibrateWrench, AxesThatNoStepReachesAreCompletedAndMarkedOrRefusedByName) {
  expect_refused(calibrate(plan_, {"--require-all"}), "no load twists about z: Mz");
  const Outcome outcome = calibrate(plan_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("no load pushes along x: Fx"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("less than half of the range: Fz 0.49 of 2.50 N, "), std::string::npos)
      << outcome.err;
  const json axes = json::parse(read_file(out_)).at("axes");
  EXPECT_EQ(axes[2].at("state"), "calibrated");
  EXPECT_NE(axes[0].at("state"), "calibrated");
  EXPECT_NE(axes[5].at("state"), "calibrated");
  EXPECT_NE(axes[5].at("reason"), "");
}

TEST_F(CalibrateWrench, WhoLosesAxesOfTheOneBeforeIsToldAndKeepsIt) {
  ASSERT_EQ(calibrate("six_orientations").status, 0);
  const std::string old = read_file(out_);
  const Outcome poorer = calibrate(plan_);
  ASSERT_EQ(poorer.status, 0) << poorer.err;
  EXPECT_NE(poorer.err.find("the calibration before knew Fx "), std::string::npos) << poorer.err;
  EXPECT_EQ(read_file(out_.string() + ".before"), old);
  const Outcome alike = calibrate(plan_);
  EXPECT_EQ(alike.err.find("the calibration before knew"), std::string::npos) << alike.err;
}

TEST_F(CalibrateWrench, StepsThatTellNoAxisReplaceNothing) {
  ASSERT_EQ(calibrate(plan_).status, 0);
  const std::string old = read_file(out_);
  std::string one = kShortPlan;
  replace(one, "      - {do: mass, mass_g: 50, at: left}\n", "");
  replace(one, "      - {do: mass, mass_g: 50, at: lower}\n", "");
  write_file(plan_, one);
  expect_refused_again(calibrate(plan_), "calibration: no axis is known from these steps: Fx (");
  EXPECT_EQ(read_file(out_), old);
  EXPECT_FALSE(std::filesystem::exists(out_.string() + ".new"));
}

TEST_F(CalibrateWrench, RunAndTheCertificateSayWhichAxesAreCompleted) {
  write_file(plan_, kUntwistedPlan);
  const Outcome outcome = calibrate(plan_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Outcome run =
      run_bridge({"run", "--sensor", sensor_, "--source", "sim:" + scenario_.string(), "--fast",
                  "--frames", "3", "--output", "jsonl:-"});
  EXPECT_NE(run.err.find("not calibrated, but as the springs are described: Mz;"),
            std::string::npos)
      << run.err;

  const std::string certificate = (temporary_ / "certificate").string();
  const Outcome written = run_bridge({"certificate", "--calibration", out_, "--out", certificate});
  if (written.err.find("apt install") != std::string::npos) GTEST_SKIP() << written.err;
  ASSERT_EQ(written.status, 0) << written.err;
  EXPECT_NE(written.err.find("Mz is not calibrated"), std::string::npos) << written.err;
  // Fx came with a little of Mz each time: the fit knows it, a score alone could not.
  const std::string said = read_file(certificate + ".json");
  EXPECT_NE(said.find("but it was never loaded without the others"), std::string::npos);
  EXPECT_EQ(said.find("times only"), std::string::npos) << "its load is far above the noise";
}

TEST_F(CalibrateWrench, WhatWasStoppedGoesOnAndBelongsToItsPlan) {
  expect_refused(calibrate(plan_, {"--seconds", "7"}), "--resume goes on", 1);
  ASSERT_TRUE(std::filesystem::exists(partial_));
  expect_refused(calibrate(plan_), "a calibration was stopped here");
  expect_refused(calibrate("six_orientations", {"--resume"}), "belongs to another plan");

  const std::string kept = read_file(partial_);
  write_file(partial_, kept.substr(0, kept.size() / 2));
  expect_refused(calibrate(plan_, {"--resume"}), "is not an interrupted calibration");
  write_file(partial_, kept);
  std::string other = before_;
  replace(other, "fx: 402.5", "fx: 410");
  write_file(sensor_, other);
  const Outcome refused = calibrate(plan_, {"--resume"});
  EXPECT_NE(refused.err.find("belongs to another sensor"), std::string::npos) << refused.err;
  write_file(sensor_, before_);

  const Outcome outcome = calibrate(plan_, {"--resume"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("going on: "), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(partial_));
}

TEST_F(CalibrateWrench, AnInterruptedOneLeavesTheOldInForce) {
  ASSERT_EQ(calibrate(plan_).status, 0);
  const std::string old = read_file(out_);
  Bridge bridge({"calibrate", "wrench", "--sensor", sensor_, "--source",
                 "sim:" + scenario_.string(), "--plan", "six_orientations"});
  ASSERT_TRUE(bridge.wait_for_message("accepted: step 2"));
  bridge.signal(SIGINT);
  const Outcome outcome = bridge.finish();
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  EXPECT_EQ(read_file(out_), old);
  EXPECT_TRUE(std::filesystem::exists(partial_));
}

TEST_F(CalibrateWrench, ABumpRepeatsWhatItSpoilt) {
  faults("bump: 2");  // orders: hang, hang, hang, let go
  const Outcome outcome = calibrate(plan_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("the sensor was bumped, or a tag has slipped"), std::string::npos)
      << outcome.err;
}

TEST_F(CalibrateWrench, ALoadCellThatIsWiredTheWrongWayRoundIsSaid) {
  write_file(scenario_, std::string(kScenario) + "bench: {load_cell: {wrong_sign: true}}\n");
  expect_refused(calibrate("load_cell"), "swap its wires", 1);
}

TEST_F(CalibrateWrench, FromItsRecordingItGivesTheSameNewtons) {
  faults("bump: 2");  // steps are accepted, lost and done again
  const std::string recording = (temporary_ / "all.twr").string();
  const Outcome live = calibrate(plan_, {"--record", recording, "--notes", "21 degrees"});
  ASSERT_EQ(live.status, 0) << live.err;
  ASSERT_NE(live.err.find("to be done again: step"), std::string::npos) << live.err;
  const json first = json::parse(read_file(out_));
  const std::string data = read_file(temporary_ / "measured" / "wrench.data.csv");
  expect_refused_again(calibrate(plan_, {"--record", recording}), "replaces nothing");

  const Outcome again = recalibrate(recording);
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(again.out, "");
  const json second = json::parse(read_file(out_));
  expect_same_newtons(first, second);
  EXPECT_EQ(read_file(temporary_ / "measured" / "wrench.data.csv"), data);
  EXPECT_EQ(second.at("notes"), "21 degrees");
  EXPECT_EQ(second.at("plan"), first.at("plan"));

  // The plan's numbers may be corrected afterwards: the weight was lighter than it was thought.
  std::string lighter = kShortPlan;
  for (int i = 0; i < 3; ++i) replace(lighter, "mass_g: 50", "mass_g: 45");
  write_file(plan_, lighter);
  ASSERT_EQ(recalibrate(recording, {"--plan", plan_}).status, 0);
  const double before = first.at("K")[2][2];
  EXPECT_NEAR(json::parse(read_file(out_)).at("K")[2][2].get<double>(), 0.9 * before,
              0.02 * before);
  expect_refused_again(recalibrate(recording, {"--plan", "six_orientations"}), "other steps");
  expect_refused_again(recalibrate(recording, {"--resume"}), "leave them out");
}

TEST_F(CalibrateWrench, ALoadCellsReadingsAreInTheRecordingToo) {
  write_file(plan_, kCellPlan);
  const std::string recording = (temporary_ / "all.twr").string();
  const Outcome live = calibrate(plan_, {"--record", recording, "--keep", "region"});
  ASSERT_EQ(live.status, 0) << live.err;
  const json first = json::parse(read_file(out_));
  const std::string data = read_file(temporary_ / "measured" / "wrench.data.csv");
  const Outcome again = recalibrate(recording);
  ASSERT_EQ(again.status, 0) << again.err;
  const json second = json::parse(read_file(out_));
  expect_same_newtons(first, second);
  EXPECT_EQ(second.at("reference"), first.at("reference"));
  EXPECT_EQ(read_file(temporary_ / "measured" / "wrench.data.csv"), data);
}

TEST_F(CalibrateWrench, ARecordingWithoutACalibrationIsRefused) {
  const std::string recording = (temporary_ / "run.twr").string();
  const Outcome record =
      run_bridge({"record", "--out", recording, "--sensor", sensor_, "--source",
                  "sim:" + scenario_.string(), "--fast", "--frames", "10", "--keep", "region"});
  ASSERT_EQ(record.status, 0) << record.err;
  expect_refused(recalibrate(recording), "record one with `tagwrench calibrate wrench --record");
  expect_refused(recalibrate(scenario_.string()), "scenario.yaml");

  const std::string stopped = (temporary_ / "stopped.twr").string();
  expect_refused(calibrate(plan_, {"--seconds", "1", "--record", stopped}), "nothing was measured",
                 1);
  expect_refused(recalibrate(stopped), "holds no step of a calibration");
}

TEST_F(CalibrateWrench, BadInputIsNamedAndNothingIsWritten) {
  std::string bad = kShortPlan;
  replace(bad, "at: lower", "at: nowhere");
  write_file(plan_, bad);
  expect_refused(calibrate(plan_), "plan.yaml:15: ");
  expect_refused(calibrate("no_such_plan"), "six_orientations");
  expect_refused(calibrate("paper", {"--resume"}), "to go on from");
  expect_refused(run_bridge({"calibrate", "wrench", "--sensor", sensor_, "--source",
                             "images:" + (temporary_ / "frames").string(), "--plan", "paper"}),
                 "nobody is there");
  expect_refused(run_bridge({"calibrate", "wrench", "--sensor", sensor_, "--plan", "paper"}),
                 "--source");
  expect_refused(calibrate("load_cell", {"--board", "/dev/null"}), "simulated instruments");
  expect_refused(calibrate("load_cell", {"--emulated-cell", "pipe"}), "--board");
  expect_refused(
      run_bridge({"calibrate", "wrench", "--sensor", sensor_, "--source", "v4l2:/dev/video0",
                  "--plan", "load_cell", "--board", "/dev/null", "--emulated-cell", "pipe"}),
      "is for the simulated sensor");
  std::filesystem::create_directory(out_.parent_path());
  write_file(out_, "a shopping list");
  const Outcome foreign = calibrate("paper");
  EXPECT_EQ(foreign.status, 2);
  EXPECT_EQ(read_file(out_), "a shopping list");
}

TEST_F(CalibrateWrench, PlansAreListedAndShownOnStandardOutput) {
  const Outcome list = run_bridge({"calibrate", "wrench", "--list-plans"});
  EXPECT_EQ(list.status, 0);
  EXPECT_EQ(lines_in(list.out), 4u);
  const Outcome show = run_bridge({"calibrate", "wrench", "--show-plan", "six_axis"});
  EXPECT_EQ(show.status, 0);
  write_file(plan_, show.out);
  EXPECT_NE(show.out.find("reference: six_axis"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test
