// The instrument calibrated by one load cell in the hand, all of it in virtual time: the simulated
// person presses the cell that is wired to the flashable image, whose LED lights the pictures that
// the tracker sees.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "host/board/cell_calibration.h"
#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/commands/calibrate_wrench/simulated_person.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tools/camera_timing/measurement.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "tests/firmware/cell_on_emulated_board.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::milliseconds;

double seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

link::BoardSessionOptions session_options() {
  link::BoardSessionOptions options;
  options.session = 0xCE11;
  return options;
}

struct InstrumentCalibration : testing::Test {
  static constexpr unsigned kChannel = 1;

  sim::Scenario scenario;
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF, {.clock_ppm = 400}};
  LockstepHost host{board, session_options()};
  std::unique_ptr<sim::Bench> bench;
  std::unique_ptr<CellOnEmulatedBoard> cell;
  std::unique_ptr<LockstepCamera> camera;

  void start() {
    ASSERT_TRUE(host.settle(milliseconds(500)));
    bench = std::make_unique<sim::Bench>(scenario.bench, scenario.seed);
    cell = std::make_unique<CellOnEmulatedBoard>(host, *bench, kChannel);
    cell->calibrate(milliseconds(700));
    BoardPatternLamp(
        host.session(), [] {}, -1)
        .steady(static_cast<int>(1000 * scenario.light.led_level));
    ASSERT_LT(board.now(), kSimulationStart);
    host.run_until(kSimulationStart - milliseconds(50));
    for (ReferenceReading old; cell->next(old);) {
    }
    camera = std::make_unique<LockstepCamera>(scenario, host, bench.get());
  }
};

TEST_F(InstrumentCalibration, TheHandsForceIsKnownAtTheTimesOfTheFrames) {
  scenario.camera.width_px = 64;  // nobody looks at these pictures
  scenario.camera.height_px = 64;
  scenario.camera.cx_px = scenario.camera.cy_px = 31.5;
  start();
  EXPECT_NEAR(cell->calibration().newtons_per_count * CellOnEmulatedBoard::kCountsPerNewton, 1,
              4 * cell->gain_sigma());
  EXPECT_LT(cell->gain_sigma(), 3e-4);
  link::SampleHistory history({.period = 1.0 / 80, .delay = 0});
  double squares = 0, normalised = 0, most = 0;
  int aligned = 0;
  bench->push({15e-3, 0, 6e-3}, {-1, 0, 0}, 0.8, 4.5, 2);
  for (int i = 0; i < 125; ++i) {
    Frame frame;
    ASSERT_EQ(camera->read(frame), ReadStatus::frame);
    host.run_until(board.now() + milliseconds(20));  // the conversion after the frame
    for (ReferenceReading reading; cell->next(reading);) {
      history.add(reading.time, reading.time_sigma, reading.value[0],
                  cell->gain_sigma() * reading.value[0]);
    }
    const link::Aligned force = history.at(frame.capture_time);
    if (i < 20 || force.status != link::AlignStatus::ok) continue;
    const double truth = camera->truth().wrench.head<3>().norm();
    EXPECT_NEAR(truth, bench->cell_force(seconds(frame.capture_time - kSimulationStart)), 1e-12);
    const double error = force.value - truth;
    squares += error * error;
    normalised += error * error / (force.sigma * force.sigma);
    most = std::max(most, truth);
    ++aligned;
  }
  const double rms = std::sqrt(squares / aligned);
  const double over_sigma = std::sqrt(normalised / aligned);
  fmt::print("{} frames, up to {:.2f} N: rms error {:.2f} mN, over sigma {:.2f}\n", aligned, most,
             1e3 * rms, over_sigma);
  ASSERT_GT(aligned, 95);
  EXPECT_GT(most, 0.5) << "N";
  EXPECT_LT(rms, 3e-3) << "N";
  EXPECT_GT(over_sigma, 0.3) << "a sigma this wide says nothing";
  EXPECT_LT(over_sigma, 1.6);
}

// The ready-made plan, its pushes shorter.
WrenchPlan short_plan() {
  std::string text = plan_text("load_cell");
  const std::string from = "seconds: 8", to = "seconds: 3";
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos;)
    text.replace(at, from.size(), to);
  return parse_plan(text, "load_cell");
}

TEST_F(InstrumentCalibration, TheLoadCellPlanFindsTheSpringsAndTheCamerasLatency) {
  constexpr double kLatency = 0.030;        // s
  constexpr double kSpringsAreOffBy = 1.2;  // what the owner believed of them
  // Pushed through guides that leave it little freedom, and the plan says so: half a degree, as of
  // a bare hand, is 2 % of Fx in every push along z.
  scenario.bench.errors.direction_rad = scenario.bench.errors.sway_rad = 1e-3;
  scenario.bench.errors.point = scenario.bench.errors.contact = 0.03e-3;
  scenario.delivery.latency = kLatency;
  start();
  WrenchPlan plan = short_plan();
  plan.line_sigma = 1.5e-3;
  for (PlanPoint& point : plan.points) point.sigma = 0.045e-3;
  const Matrix6 truth = sim::stiffness(scenario.mechanics);
  const Vector6 range = Vector6::Map(scenario.mechanics.range.data());
  GuideOptions options;
  options.stiffness = kSpringsAreOffBy * truth;
  options.range = range;
  options.attempts = 3;
  WrenchGuide guide(plan, options);
  SimulatedPerson person(*bench, plan, range);
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);

  constexpr int kMaxFrames = 25 * 240;
  int frames = 0;
  for (; frames < kMaxFrames && !guide.done(); ++frames) {
    for (ReferenceReading reading; cell->next(reading);) {
      ReferenceSample sample;
      sample.time = seconds(reading.time);
      sample.value[0] = reading.value[0];
      sample.sigma[0] = reading.sigma[0];
      sample.saturated = reading.saturated;
      guide.reading(sample);
    }
    Frame frame;
    ASSERT_EQ(camera->read(frame), ReadStatus::frame);
    person.look_at(guide);
    guide.frame(seconds(frame.capture_time), tracker.track(frame));
    for (GuideLine line; guide.next(line);) {
      if (line.kind == GuideLine::Kind::warning) fmt::print("{}\n", line.text);
    }
  }
  ASSERT_TRUE(guide.done()) << "after " << frames << " frames";
  ASSERT_FALSE(guide.failed()) << guide.failure();
  EXPECT_TRUE(guide.skipped().empty());

  const WrenchData data = collect(plan, guide.records(), cell->gain_sigma());
  FitOptions fit_options;
  fit_options.prior = options.stiffness;
  const WrenchFit fit = fit_wrench(data.observations, data.path, fit_options);
  fmt::print("{:.0f} s of simulated time, {} observations; lag {:.2f} +- {:.2f} ms\n",
             frames / 25.0, data.observations.size(), 1e3 * data.lag.value, 1e3 * data.lag.sigma);
  EXPECT_TRUE(data.lag.known);
  EXPECT_NEAR(data.lag.value, kLatency, 2e-3);

  // From then on it measures what the hand does.
  WrenchEstimator estimator(fit.model);
  bench->move_about(0.6 * range, 8, 0.5);
  Vector6 squares = Vector6::Zero(), normalised = Vector6::Zero(), largest = Vector6::Zero();
  int moved = 0;
  while (bench->busy()) {
    Frame frame;
    ASSERT_EQ(camera->read(frame), ReadStatus::frame);
    Sample sample;
    sample.capture_time = frame.capture_time;
    estimator.estimate(tracker.track(frame), sample);
    const Vector6& load = camera->truth().wrench;
    if (load.isZero(0)) continue;
    ASSERT_TRUE(carries_numbers(sample.status));
    const Vector6 error = sample.wrench - load;
    squares += error.cwiseQuotient(range).cwiseAbs2();
    normalised += error.cwiseQuotient(sample.wrench_sigma).cwiseAbs2();
    largest = largest.cwiseMax(load.cwiseQuotient(range).cwiseAbs());
    ++moved;
  }
  ASSERT_GT(moved, 150);
  squares /= moved;
  normalised /= moved;
  for (int axis = 0; axis < 6; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    fmt::print("{}: {:.2f} % of range, over sigma {:.2f}, {}\n", kWrenchAxes[at],
               100 * std::sqrt(squares[axis]), std::sqrt(normalised[axis]),
               name(fit.axis[at].state));
    EXPECT_EQ(fit.axis[at].state, AxisState::calibrated) << kWrenchAxes[at];
    EXPECT_LT(std::sqrt(squares[axis]), 0.01) << kWrenchAxes[at];
    EXPECT_LT(std::sqrt(normalised[axis]), 3) << kWrenchAxes[at];
    EXPECT_GT(largest[axis], 0.3) << kWrenchAxes[at] << " was hardly loaded";
  }
  // One calibration is one draw of each error, alike in all that is measured afterwards.
  EXPECT_LT(std::sqrt(normalised.mean()), 1.6);
  EXPECT_GT(std::sqrt(normalised.mean()), 0.3) << "a sigma this wide says nothing";
  EXPECT_EQ(host.session().counters().lost_conversions, 0U);
}

}  // namespace
}  // namespace tagwrench::emulator
