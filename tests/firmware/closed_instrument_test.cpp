// The whole instrument closed, in virtual time: the simulated sensor before the flashable image.
// The image's LED lights the simulated pictures, its load cells feel the simulated hand, and the
// host brings both onto one clock.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/board/cell_calibration.h"
#include "host/source/simulator/trajectory.h"
#include "host/tools/camera_timing/measurement.h"
#include "tests/firmware/lockstep_camera.h"
#include "tests/firmware/lockstep_host.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

sim::Scenario small_scenario() {
  sim::Scenario scenario = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/camera_timing.yaml");
  scenario.camera.width_px = 320;
  scenario.camera.height_px = 240;
  scenario.camera.fx_px = scenario.camera.fy_px = 402.5;
  scenario.camera.cx_px = 159.5;
  scenario.camera.cy_px = 119.5;
  return scenario;
}

double mean_level(const Frame& frame) {
  const std::uint8_t* pixels = frame.image.pixels;
  const std::size_t count =
      static_cast<std::size_t>(frame.image.width) * static_cast<std::size_t>(frame.image.height);
  return std::accumulate(pixels, pixels + count, 0.0) / static_cast<double>(count);
}

link::BoardSessionOptions session_options() {
  link::BoardSessionOptions options;
  options.session = 0x5EED;
  return options;
}

struct ClosedInstrument : testing::Test {
  BoardOptions board_options{.clock_ppm = -700};
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF, board_options};
  LockstepHost host{board, session_options()};

  void start() {
    ASSERT_TRUE(host.settle(seconds(1)));
    host.run_until(kSimulationStart - milliseconds(200));
  }
};

TEST_F(ClosedInstrument, TheLedsLevelIsTheBrightnessOfThePicture) {
  start();
  sim::Scenario scenario = small_scenario();
  scenario.delivery = {};
  scenario.disturbances = {};
  scenario.light.room = 0.02;
  scenario.light.glare_counts = 0;
  scenario.noise.read_counts = scenario.noise.shot_counts_per_count = 0;
  LockstepCamera camera(scenario, host);
  BoardPatternLamp lamp(
      host.session(), [] {}, -1);
  const auto brightness = [&](int permille) {
    lamp.steady(permille);
    Frame frame;
    for (int i = 0; i < 4; ++i) camera.read(frame);
    return mean_level(frame);
  };
  const double full = brightness(1000);
  for (const int permille : {50, 137, 300}) {
    // Rounding of the pixels takes half a grey level at most.
    EXPECT_NEAR(brightness(permille) / full, (0.02 + 1e-3 * permille) / 1.02, 0.012) << permille;
  }
  lamp.off();
  Frame frame;
  for (int i = 0; i < 4; ++i) camera.read(frame);
  EXPECT_NEAR(mean_level(frame) / full, 0.02 / 1.02, 0.01);
}

TEST_F(ClosedInstrument, LoadCellsGiveNewtonsAtTheTimesOfTheFrames) {
  constexpr double kCountsPerNewton = 200000, kNoise = 60;
  constexpr int kFrames = 120;
  sim::Scenario scenario = small_scenario();
  scenario.trajectory.motion = sim::Motion::compound;
  scenario.trajectory.rest_time = 0.2;
  scenario.trajectory.bandwidth = 1.0;
  const sim::TrajectoryPlayer hand(scenario.trajectory, scenario.seed);
  link::CellCalibrations cells;
  for (unsigned c = 0; c < kCells; ++c) {
    Hx711::Bridge& bridge = board.cell(c).bridge();
    bridge.counts_per_newton = kCountsPerNewton * (1 + 0.02 * c);
    bridge.offset_counts = 30000 + 5000.0 * c;
    bridge.noise_counts = kNoise;
    bridge.force = [&hand](VirtualTime time) {
      const double t = std::chrono::duration<double>(time - kSimulationStart).count();
      return t < 0 ? 0.0 : hand.applied_wrench(t)[2] / kCells;
    };
    const auto counts = [&bridge](double mass_kg) {
      return bridge.offset_counts + bridge.counts_per_newton * mass_kg * link::kStandardGravity;
    };
    cells[c] = link::fit_cell({{0, counts(0), 5}, {0.1, counts(0.1), 5}});
  }
  start();
  LockstepCamera camera(scenario, host);
  std::vector<link::SampleHistory> histories(kCells,
                                             link::SampleHistory({.period = 1.0 / 80, .delay = 0}));
  const auto drain = [&] {
    for (link::CellReading reading; host.session().next(reading);) {
      const link::Newtons force = cells[reading.channel].newtons(reading.counts);
      histories[reading.channel].add(reading.time.time, reading.time.sigma, force.value,
                                     force.sigma, reading.lost_before > 0);
    }
  };
  double squares = 0, normalised = 0, worst = 0, range = 0;
  int aligned = 0;
  for (int i = 0; i < kFrames; ++i) {
    Frame frame;
    ASSERT_EQ(camera.read(frame), ReadStatus::frame);
    // The picture is that of its exposure, a latency before the stamp, which bandwidth tells.
    const TimePoint exposed = TimePoint(kSimulationStart) + camera.truth().time;
    host.run_until(frame.capture_time.time_since_epoch() + milliseconds(2));
    drain();
    double sum = 0, variance = 0;
    bool all = i > 30;  // the noise is known by then
    for (const link::SampleHistory& history : histories) {
      const link::Aligned force = history.at(exposed);
      all = all && force.status == link::AlignStatus::ok;
      sum += force.value;
      variance += force.sigma * force.sigma;
    }
    if (!all) continue;
    const double error = sum - camera.truth().wrench[2];
    squares += error * error;
    normalised += error * error / variance;
    worst = std::max(worst, std::abs(error));
    range = std::max(range, std::abs(camera.truth().wrench[2]));
    ++aligned;
  }
  ASSERT_GT(aligned, 70);
  const double rms = std::sqrt(squares / aligned);
  fmt::print(
      "{} of {} frames: rms error {:.2f} mN, worst {:.2f} mN, of up to {:.2f} N; error over "
      "sigma, rms {:.2f}\n",
      aligned, kFrames, 1e3 * rms, 1e3 * worst, range, std::sqrt(normalised / aligned));
  EXPECT_GT(range, 0.3) << "N; the hand pushes";
  EXPECT_LT(rms, 5e-3) << "N";
  EXPECT_LT(std::sqrt(normalised / aligned), 1.6);
  EXPECT_GT(std::sqrt(normalised / aligned), 0.3) << "a sigma this wide says nothing";
  EXPECT_EQ(host.session().counters().lost_conversions, 0U);
}

TEST_F(ClosedInstrument, BandwidthRecoversTheCameraThroughTheBoard) {
  start();
  const sim::Scenario scenario = small_scenario();
  LockstepCamera camera(scenario, host);
  BoardPatternLamp lamp(
      host.session(), [] {}, -1);
  CameraTimingOptions options;
  options.seconds = 8;
  options.reference_seconds = 1;
  const CameraTimingMeasurement measured = measure_camera_timing(camera, lamp, options);
  ASSERT_EQ(measured.refusal, "");
  const CameraTimingResult& r = measured.result;
  fmt::print(
      "rate {:.5f} +- {:.5f} Hz, latency {:.3f} +- {:.3f} ms, jitter {:.3f} ms, read-out {:.4f} +- "
      "{:.4f} ms, exposure {:.4f} ms, {} frames, {} timed, {} stale, {} strange, {} missing; clock "
      "+- {:.1f} us\n",
      r.frame_rate.value, r.frame_rate.sigma, 1e3 * r.latency.value, 1e3 * r.latency.sigma,
      1e3 * r.jitter.value, 1e3 * r.readout.value, 1e3 * r.readout.sigma, 1e3 * r.exposure.value,
      r.frames, r.timed, r.stale, r.strange, r.missing, 1e6 * measured.edge_sigma);
  const double rate = scenario.delivery.true_frame_rate;
  EXPECT_NEAR(r.frame_rate.value, rate, 1e-3 * rate);
  EXPECT_NEAR(r.latency.value, scenario.delivery.latency, 0.5e-3);
  EXPECT_NEAR(r.readout.value, scenario.exposure.rolling_readout,
              0.05 * scenario.exposure.rolling_readout);
  EXPECT_LT(std::abs(r.latency.value - scenario.delivery.latency), 4 * r.latency.sigma);
  EXPECT_EQ(r.missing, r.dropped_by_driver + r.stale);
  EXPECT_GT(r.stale, 0);
  EXPECT_EQ(board.gate_conflicts(), 0U);
}

}  // namespace
}  // namespace tagwrench::emulator
