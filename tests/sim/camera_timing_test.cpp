// The whole measurement on the simulated camera, whose truth is known: pictures of a flashing lamp
// in, frame rate, latency, read-out and bad frames out.
#include "host/tools/camera_timing/camera_timing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "host/app/scenario_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tools/camera_timing/flip_patches.h"
#include "host/tools/camera_timing/measurement.h"

namespace tagwrench::test {
namespace {

/// The simulated camera, keeping the truth about each frame it delivered.
class WatchedCamera final : public FrameSource {
 public:
  struct Delivered {
    double stamp, exposed;
    bool stale;
  };
  WatchedCamera(const sim::Scenario& scenario, SimulatedLamp& lamp)
      : camera_(scenario, /*live=*/false, &lamp) {
    lamp.set_time_zero(camera_.time_zero());
  }
  const SourceFormat& format() const noexcept override { return camera_.format(); }
  int poll_fd() const noexcept override { return -1; }
  CameraLight* camera_light() noexcept override { return camera_.camera_light(); }
  ReadStatus read(Frame& frame) noexcept override {
    const ReadStatus status = camera_.read(frame);
    lost += frame.dropped;
    delivered.push_back(
        {std::chrono::duration<double>(frame.capture_time.time_since_epoch()).count(),
         std::chrono::duration<double>(camera_.truth().time).count(), camera_.truth().stale});
    return status;
  }
  std::vector<Delivered> delivered;
  std::uint64_t lost = 0;

 private:
  SimulatorSource camera_;
};

sim::Scenario camera_timing_scenario() {
  return load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/camera_timing.yaml");
}

struct Measured {
  CameraTimingMeasurement measurement;
  std::vector<WatchedCamera::Delivered> frames;  ///< those of the pattern
  int stale = 0;
};

Measured measure(const sim::Scenario& scenario, double seconds = 10) {
  SimulatedLamp lamp(/*live=*/false);
  WatchedCamera camera(scenario, lamp);
  CameraTimingOptions options;
  options.seconds = seconds;
  Measured out{measure_camera_timing(camera, lamp, options), {}, 0};
  // The last frame ended the measurement and is not part of it.
  const std::size_t used = out.measurement.result.times.size();
  if (camera.delivered.size() > used)
    out.frames.assign(camera.delivered.end() - 1 - static_cast<std::ptrdiff_t>(used),
                      camera.delivered.end() - 1);
  for (const auto& frame : out.frames) out.stale += frame.stale ? 1 : 0;
  return out;
}

TEST(CameraTimingMeasurement, RecoversTheScenario) {
  const sim::Scenario scenario = camera_timing_scenario();
  const Measured measured = measure(scenario);
  const CameraTimingResult& r = measured.measurement.result;
  ASSERT_EQ(measured.measurement.refusal, "");
  const double rate = scenario.delivery.true_frame_rate;
  std::printf(
      "rate %.5f +- %.5f Hz, latency %.3f +- %.3f ms, read-out %.4f +- %.4f ms, exposure "
      "%.4f ms, %d stale, %d missing\n",
      r.frame_rate.value, r.frame_rate.sigma, 1e3 * r.latency.value, 1e3 * r.latency.sigma,
      1e3 * r.readout.value, 1e3 * r.readout.sigma, 1e3 * r.exposure.value, r.stale, r.missing);
  EXPECT_NEAR(r.frame_rate.value, rate, 1e-3 * rate);
  EXPECT_NEAR(r.latency.value, scenario.delivery.latency, 0.5e-3);
  EXPECT_NEAR(r.jitter.value, scenario.delivery.jitter, 0.3e-3);
  EXPECT_NEAR(r.readout.value, scenario.exposure.rolling_readout,
              0.05 * scenario.exposure.rolling_readout);
  EXPECT_NEAR(r.exposure.value, scenario.exposure.time, 0.05 * scenario.exposure.time);
  EXPECT_LT(std::abs(r.latency.value - scenario.delivery.latency), 4 * r.latency.sigma);
}

TEST(CameraTimingMeasurement, FindsEveryStaleAndEveryLostFrame) {
  const Measured measured = measure(camera_timing_scenario(), 20);
  const CameraTimingResult& r = measured.measurement.result;
  ASSERT_EQ(measured.measurement.refusal, "");
  ASSERT_EQ(r.times.size(), measured.frames.size());
  ASSERT_GT(measured.stale, 3);
  for (std::size_t i = 0; i < r.times.size(); ++i) {
    EXPECT_EQ(r.times[i].freshness == Freshness::stale, measured.frames[i].stale) << "frame " << i;
    if (r.times[i].timed) {
      EXPECT_NEAR(r.times[i].exposed, measured.frames[i].exposed, 20e-6) << "frame " << i;
    }
  }
  // Exposures between the first and the last frame of which no picture came.
  const double rate = camera_timing_scenario().delivery.true_frame_rate;
  const double exposures =
      std::round((measured.frames.back().exposed - measured.frames.front().exposed) * rate) + 1;
  EXPECT_EQ(r.missing, static_cast<int>(exposures) - (r.frames - r.stale));
  EXPECT_GT(r.dropped_by_driver, 0);
}

TEST(CameraTimingMeasurement, ShortensTheExposureOfACameraThatTheLedBlinds) {
  sim::Scenario scenario = camera_timing_scenario();
  scenario.light.led_level = 0.2;  // five times the light, when it is always on
  const Measured measured = measure(scenario);
  ASSERT_EQ(measured.measurement.refusal, "");
  EXPECT_LT(measured.measurement.exposure_set_us, 1500);
  EXPECT_LT(measured.measurement.saturated_fraction, 0.05);
  const CameraTimingResult& r = measured.measurement.result;
  EXPECT_NEAR(r.exposure.value, 1e-6 * measured.measurement.exposure_set_us, 50e-6);
  EXPECT_NEAR(r.latency.value, scenario.delivery.latency, 0.5e-3);
}

TEST(CameraTimingMeasurement, SaysWhyASceneTellsNothing) {
  sim::Scenario dark = camera_timing_scenario();
  dark.light.level_counts = 5;
  dark.light.glare_counts = 0;
  EXPECT_NE(measure(dark).measurement.refusal.find("LED does not show"), std::string::npos);
  sim::Scenario sunny = camera_timing_scenario();
  sunny.light.level_counts = 25;
  sunny.light.glare_counts = 0;
  sunny.light.room = 7;
  EXPECT_NE(measure(sunny).measurement.refusal.find("not the LED's"), std::string::npos);
}

TEST(ScreenMeasurement, RecoversFrameRateAndLatency) {
  sim::Scenario scenario = camera_timing_scenario();
  scenario.delivery.stale_share = 0;
  SimulatedLamp screen(/*live=*/false);
  WatchedCamera camera(scenario, screen);
  ScreenOptions options;
  options.seconds = 20;
  const ScreenMeasurement m = measure_screen(camera, screen, options);
  ASSERT_EQ(m.refusal, "");
  std::printf("rate %.4f +- %.4f Hz, latency %.2f +- %.2f ms, %d flips\n", m.frame_rate.value,
              m.frame_rate.sigma, 1e3 * m.latency.value, 1e3 * m.latency.sigma, m.flips);
  EXPECT_NEAR(m.frame_rate.value, scenario.delivery.true_frame_rate, 0.01);
  EXPECT_LT(std::abs(m.latency.value - scenario.delivery.latency), 3 * m.latency.sigma);
  EXPECT_LT(m.latency.sigma, 2e-3);
  EXPECT_GT(m.flips, 100);
  EXPECT_EQ(m.missed, 0);
}

TEST(ScreenWindow, FlipsNoEarlierThanItIsTold) {
  ::setenv("SDL_VIDEODRIVER", "dummy", 1);
  ScreenWindow window;
  EXPECT_NE(window.description().find("dummy"), std::string::npos);
  const TimePoint soon = std::chrono::steady_clock::now() + std::chrono::milliseconds(30);
  window.show(true, soon);
  EXPECT_GE(window.shown(), soon);
  EXPECT_EQ(window.ended(), "");
  window.show(false, soon - std::chrono::seconds(1));
  EXPECT_GT(window.shown(), soon) << "now, where the time is past";
}

TEST(ScreenMeasurement, SaysThatTheScreenIsNotInView) {
  sim::Scenario scenario = camera_timing_scenario();
  scenario.light.level_counts = 1;
  scenario.light.glare_counts = 0;
  SimulatedLamp screen(/*live=*/false);
  WatchedCamera camera(scenario, screen);
  EXPECT_NE(measure_screen(camera, screen, {}).refusal.find("does not see the screen"),
            std::string::npos);
}

TEST(CameraTimingMeasurement, TheReportsSayTheSame) {
  const Measured measured = measure(camera_timing_scenario(), 4);
  ASSERT_EQ(measured.measurement.refusal, "");
  const CameraTimingSetting setting{"the camera", "the lamp", "nowhere", 0.04};
  const std::string text = report_text(measured.measurement, setting);
  const nlohmann::json json = nlohmann::json::parse(report_json(measured.measurement, setting));
  EXPECT_NEAR(json.at("frame_rate_hz").at("value").get<double>(), 24.87, 0.01);
  EXPECT_TRUE(json.at("rolling_shutter").get<bool>());
  EXPECT_EQ(json.at("frames").at("stale").get<int>(), measured.stale);
  EXPECT_NE(text.find("24.87"), std::string::npos) << text;
  EXPECT_NE(text.find("rolling shutter"), std::string::npos) << text;
  EXPECT_NE(text.find("announced 25 Hz"), std::string::npos) << text;
}

}  // namespace
}  // namespace tagwrench::test
