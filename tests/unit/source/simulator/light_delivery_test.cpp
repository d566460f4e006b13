// Light from an LED outside, what delivery does to times and pictures, and exposure and gain.
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/core/config_error.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {
namespace {

constexpr int kWidth = 160, kHeight = 120;

sim::Scenario small() {
  sim::Scenario s;
  s.camera.width_px = kWidth;
  s.camera.height_px = kHeight;
  s.camera.fx_px = s.camera.fy_px = 201;
  s.camera.cx_px = 79.5;
  s.camera.cy_px = 59.5;
  s.camera.frame_rate = 25;
  s.light.level_counts = 180;
  s.light.glare_counts = 0;
  s.noise.read_counts = s.noise.shot_counts_per_count = 0;
  s.trajectory.motion = sim::Motion::rest;
  return s;
}

/// On from one instant to another.
class Flash final : public sim::LedLight {
 public:
  double begin = -1e9, end = 1e9, level = 1;
  std::vector<std::pair<double, double>> asked;
  double mean(double from, double to) noexcept override {
    asked.emplace_back(from, to);
    const double on = std::max(0.0, std::min(to, end) - std::max(from, begin));
    return level * on / (to - from);
  }
};

std::vector<std::uint8_t> picture(SimulatorSource& source) {
  Frame frame;
  EXPECT_EQ(source.read(frame), ReadStatus::frame);
  return {frame.image.pixels, frame.image.pixels + kWidth * kHeight};
}

double row_sum(const std::vector<std::uint8_t>& pixels, int row) {
  double sum = 0;
  for (int i = 0; i < kWidth; ++i) sum += pixels[static_cast<std::size_t>(row * kWidth + i)];
  return sum;
}

TEST(SimulatedLed, AtItsNominalLevelThePictureIsTheScenarios) {
  sim::Scenario scenario = small();
  scenario.light.led_level = 0.25;
  scenario.light.room = 0;
  Flash led;
  led.level = 0.25;
  SimulatorSource plain(scenario, false), lit(scenario, false, &led);
  EXPECT_EQ(picture(plain), picture(lit));
}

TEST(SimulatedLed, BrightnessIsLedPlusRoom) {
  sim::Scenario scenario = small();
  scenario.light.led_level = 0.5;
  scenario.light.room = 0.1;
  Flash led;
  led.level = 0.2;  // 0.4 of the nominal light, and 0.1
  SimulatorSource plain(scenario, false), dim(scenario, false, &led);
  const double ratio = row_sum(picture(dim), 60) / row_sum(picture(plain), 60);
  EXPECT_NEAR(ratio, 0.5, 0.01);
}

TEST(SimulatedLed, ARollingShutterShowsAFlashInTheRowsExposedDuringIt) {
  sim::Scenario scenario = small();
  scenario.exposure.time = 2e-3;
  scenario.exposure.rolling_readout = 20e-3;
  scenario.light.led_level = 1;
  scenario.light.room = 0;
  Flash led;
  led.begin = 0;  // the middle of the first frame: the upper half is dark
  SimulatorSource source(scenario, false, &led);
  const std::vector<std::uint8_t> pixels = picture(source);
  EXPECT_EQ(row_sum(pixels, 50), 0);
  EXPECT_GT(row_sum(pixels, 70), kWidth * 20.0);
  // Row 60's middle is 0.5 / 120 of the readout after the frame's: lit for a bit more than half.
  Flash always;
  SimulatorSource lit(scenario, false, &always);
  const double share = row_sum(pixels, 60) / row_sum(picture(lit), 60);
  EXPECT_NEAR(share, 0.5 + 0.5 / 120 * 20 / 2, 0.01);
  EXPECT_EQ(led.asked.size(), 120U);
  EXPECT_NEAR(led.asked.front().first, -10e-3 - 1e-3 + 0.5 / 120 * 20e-3, 1e-9);
  EXPECT_NEAR(led.asked.back().second, 10e-3 + 1e-3 - 0.5 / 120 * 20e-3, 1e-9);
}

TEST(Delivery, StampsAreLateByLatencyAndJitter) {
  sim::Scenario scenario = small();
  scenario.delivery.latency = 23e-3;
  scenario.delivery.jitter = 2e-3;
  scenario.delivery.true_frame_rate = 24.5;
  SimulatorSource source(scenario, false);
  EXPECT_EQ(source.format().period, Duration(40'000'000)) << "as announced";
  constexpr int kFrames = 400;
  double sum = 0, squares = 0, least = 1;
  TimePoint before{};
  for (int i = 0; i < kFrames; ++i) {
    Frame frame;
    source.read(frame);
    EXPECT_NEAR(std::chrono::duration<double>(source.truth().time).count(), i / 24.5, 1e-6);
    const double delay =
        std::chrono::duration<double>(frame.capture_time.time_since_epoch() - source.truth().time)
            .count();
    sum += delay;
    squares += delay * delay;
    least = std::min(least, delay);
    EXPECT_GT(frame.capture_time, before);
    before = frame.capture_time;
  }
  const double mean = sum / kFrames;
  EXPECT_NEAR(mean, 23e-3, 4 * 2e-3 / std::sqrt(kFrames));
  EXPECT_NEAR(std::sqrt(squares / kFrames - mean * mean), 2e-3, 0.5e-3);
  EXPECT_GE(least, 21e-3 - 1e-8);
}

TEST(Delivery, AStaleFrameShowsThePictureBeforeItUnderANewStamp) {
  sim::Scenario scenario = small();
  scenario.noise.read_counts = 2;
  scenario.delivery.stale_share = 0.2;
  SimulatorSource source(scenario, false);
  std::vector<std::uint8_t> before;
  Duration exposed{};
  int stale = 0;
  constexpr int kFrames = 200;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const std::vector<std::uint8_t> now = picture(source);
    EXPECT_EQ(source.truth().sequence, i);
    if (source.truth().stale) {
      ++stale;
      EXPECT_EQ(now, before);
      EXPECT_EQ(source.truth().time, exposed);
    } else {
      EXPECT_NE(now, before);
      EXPECT_EQ(source.truth().time, Duration(40'000'000) * static_cast<std::int64_t>(i));
    }
    before = now;
    exposed = source.truth().time;
  }
  EXPECT_NEAR(stale, 0.2 * kFrames, 4 * std::sqrt(0.2 * 0.8 * kFrames));
}

TEST(Delivery, ALiveFrameComesWhenItsStampSays) {
  sim::Scenario scenario = small();
  scenario.camera.frame_rate = 100;
  scenario.delivery.latency = 30e-3;
  scenario.delivery.jitter = 0.9e-3;
  const TimePoint before = std::chrono::steady_clock::now();
  SimulatorSource source(scenario, true);
  for (int i = 0; i < 5; ++i) {
    Frame frame;
    pollfd wait{source.poll_fd(), POLLIN, 0};
    ASSERT_EQ(::poll(&wait, 1, 5000), 1);
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    EXPECT_LE(frame.capture_time, std::chrono::steady_clock::now()) << "a stamp in the future";
    const TimePoint exposed = source.time_zero() + source.truth().time;
    EXPECT_GE(frame.capture_time - exposed, std::chrono::microseconds(29'099));
    EXPECT_GT(exposed, before);
  }
}

TEST(Delivery, RefusesWhatCannotBe) {
  for (const auto& [text, part] :
       {std::pair{"delivery: {jitter_ms: 1}", "jitter_ms"},
        std::pair{"delivery: {latency_ms: 20, jitter_ms: 9}", "jitter_ms"},
        std::pair{"delivery: {stale_share: 0.9}", "stale_share"},
        std::pair{"delivery: {true_fps: -3}", "true_fps"},
        std::pair{"delivery: {latency_s: 3}", "unknown key"},
        std::pair{"light: {led_level: 0}", "led_level"},
        std::pair{"exposure: {time_ms: 30}\ndelivery: {true_fps: 40}", "frame period"}}) {
    try {
      parse_scenario(std::string(text) + "\n", "s.yaml");
      ADD_FAILURE() << "accepted " << text;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("s.yaml:"), std::string::npos) << error.what();
    }
  }
}

TEST(SimulatedCameraLight, BrightnessGoesWithExposureTimesGain) {
  SimulatorSource reference(small(), false), source(small(), false);
  CameraLight* camera = source.camera_light();
  ASSERT_NE(camera, nullptr);
  EXPECT_DOUBLE_EQ(camera->exposure_us(), 4000);
  ASSERT_TRUE(camera->set_exposure_us(1000));
  ASSERT_TRUE(camera->set_gain(2));
  const double ratio = row_sum(picture(source), 60) / row_sum(picture(reference), 60);
  EXPECT_NEAR(ratio, 0.5, 0.01);
}

TEST(SimulatedCameraLight, GainAmplifiesNoiseAndAShortExposureDoesNot) {
  sim::Scenario scenario = small();
  scenario.noise.read_counts = 1;
  const auto noise = [&](double exposure_us, double gain) {
    sim::Scenario noiseless = scenario;
    noiseless.noise.read_counts = 0;
    SimulatorSource with(scenario, false), without(noiseless, false);
    double squares = 0;
    for (SimulatorSource* source : {&with, &without}) {
      source->camera_light()->set_exposure_us(exposure_us);
      source->camera_light()->set_gain(gain);
    }
    const auto a = picture(with), b = picture(without);
    for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(double(a[i]) - double(b[i]), 2);
    return std::sqrt(squares / static_cast<double>(a.size()));
  };
  const double usual = noise(2000, 1);
  EXPECT_NEAR(noise(1000, 1) / usual, 1, 0.05);
  EXPECT_NEAR(noise(500, 4) / usual, 4, 0.6) << "rounding adds 0.3 counts to either";
}

TEST(SimulatedCameraLight, StaysWithinItsRange) {
  sim::Scenario scenario = small();
  scenario.exposure.rolling_readout = 18e-3;
  SimulatorSource source(scenario, false);
  CameraLight* camera = source.camera_light();
  EXPECT_NEAR(camera->exposure_range_us().most, 22'000, 1e-6) << "read-out takes the rest";
  EXPECT_TRUE(camera->set_exposure_us(1e6));
  EXPECT_NEAR(camera->exposure_us(), 22'000, 1e-6);
  EXPECT_TRUE(camera->set_gain(0));
  EXPECT_EQ(camera->gain(), 1);
  EXPECT_FALSE(camera->set_exposure_us(std::nan("")));
}

}  // namespace
}  // namespace tagwrench
