// Brightness, closed: camera settings and LED level change the simulated picture, which changes
// them.
#include <gtest/gtest.h>

#include "host/calibration/light/control.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

/// An LED that obeys at once, and takes note of what it was told.
class BenchLamp final : public Lamp, public sim::LedLight {
 public:
  void set_level(double permille) noexcept override {
    level_ = permille;
    highest_ = std::max(highest_, permille);
  }
  LightRange range_permille() const noexcept override { return {10, 300}; }
  int poll_fd() const noexcept override { return -1; }
  void service() noexcept override {}
  double mean(double, double) noexcept override { return wired ? level_ / 1000 : 0; }

  double level() const { return level_; }
  double highest() const { return highest_; }
  bool wired = true;

 private:
  double level_ = 0;
  double highest_ = 0;
};

struct Room {
  explicit Room(const sim::Scenario& scenario)
      : sensor(parse_sensor(sim::sensor_yaml(scenario), "scenario")),
        source(scenario, false, &lamp),
        finder(sensor.camera, sensor.target) {}

  LightReport settle() {
    return settle_light(source, finder, sensor.camera.mirrored, lamp, UniqueFd());
  }

  BenchLamp lamp;
  SensorConfig sensor;
  SimulatorSource source;
  Acquirer finder;
};

sim::Scenario still() {
  sim::Scenario scenario;
  scenario.trajectory.motion = sim::Motion::rest;
  return scenario;
}

/// Grey level that one pixel in 500 of the picture's middle exceeds: around the tags.
int brightest(SimulatorSource& source) {
  Frame frame;
  EXPECT_EQ(source.read(frame), ReadStatus::frame);
  std::vector<std::uint8_t> levels;
  for (int y = 100; y < 380; ++y) {
    const std::uint8_t* row = frame.image.pixels + y * frame.image.stride;
    levels.insert(levels.end(), row + 220, row + 420);
  }
  std::sort(levels.begin(), levels.end());
  return levels[levels.size() - levels.size() / 500];
}

TEST(LightSettle, TheWhiteOfTheTagsComesToItsLevelWithAShortExposureAndNothingClips) {
  Room room(still());
  const LightReport report = room.settle();
  EXPECT_EQ(report.state, LightControl::State::settled) << light_text(report);
  EXPECT_EQ(report.tags_found, 2);
  EXPECT_NEAR(report.white_counts, LightControl::kTarget_counts, LightControl::kTolerance_counts);
  EXPECT_LE(report.setting.exposure_us, 4000);
  EXPECT_DOUBLE_EQ(room.lamp.level(), report.setting.led_permille) << "lit again in the end";
  EXPECT_LT(brightest(room.source), 250);
}

TEST(LightSettle, AMuchTooBrightLedIsTakenBackAndADimOneIsHelpedByGain) {
  sim::Scenario bright = still();
  bright.light.led_level = 0.03;  // an LED ten times as bright
  Room glaring(bright);
  const LightReport taken_back = glaring.settle();
  EXPECT_EQ(taken_back.state, LightControl::State::settled) << light_text(taken_back);
  EXPECT_LT(taken_back.setting.led_permille, 60);

  sim::Scenario dim = still();
  dim.light.led_level = 1.0;
  Room gloomy(dim);
  const LightReport helped = gloomy.settle();
  EXPECT_EQ(helped.state, LightControl::State::settled) << light_text(helped);
  EXPECT_DOUBLE_EQ(helped.setting.led_permille, 300);
  EXPECT_GT(helped.setting.gain, 1.5);
  EXPECT_LE(gloomy.lamp.highest(), 300) << "never beyond what the LED may have for ever";
}

TEST(LightSettle, AmbientLightIsMeasuredAndSaid) {
  sim::Scenario scenario = still();
  scenario.light.room = 0.05;
  Room shaded(scenario);
  const LightReport little = shaded.settle();
  scenario.light.room = 0.6;
  Room sunny(scenario);
  const LightReport much = sunny.settle();
  EXPECT_LT(little.ambient_fraction, 0.15);
  EXPECT_GT(much.ambient_fraction, 0.4);
  EXPECT_NE(light_text(much).find("keep other light off"), std::string::npos) << light_text(much);
  EXPECT_EQ(light_text(little).find("keep other light off"), std::string::npos);
}

TEST(LightSettle, AnLedThatIsNotWiredIsSaid) {
  sim::Scenario scenario = still();
  scenario.light.room = 0.5;
  Room room(scenario);
  room.lamp.wired = false;
  const LightReport report = room.settle();
  EXPECT_GT(report.ambient_fraction, 0.9);
  EXPECT_NE(light_text(report).find("is it wired?"), std::string::npos) << light_text(report);
}

TEST(LightSettle, DarknessIsSaid) {
  sim::Scenario scenario = still();
  scenario.light.room = 0;
  Room room(scenario);
  room.lamp.wired = false;
  const LightReport report = room.settle();
  EXPECT_EQ(report.state, LightControl::State::too_dark);
  EXPECT_EQ(report.tags_found, 0);
}

}  // namespace
}  // namespace tagwrench
