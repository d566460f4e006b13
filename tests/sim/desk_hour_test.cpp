// An hour of work at the desk, as an input device feels it. TAGWRENCH_DESK_SECONDS makes the run
// with rendered pictures longer: 3600 is an hour.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "host/app/scenario_config.h"
#include "host/motion/gestures.h"
#include "host/motion/shaping.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"
#include "tests/support/desk_judge.h"
#include "tests/support/desk_readings.h"

namespace tagwrench::test {
namespace {

sim::Scenario desk_scenario(std::uint64_t seed = 1) {
  sim::Scenario scenario = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/desk.yaml");
  scenario.seed = seed;
  return scenario;
}

Vector6 range_of(const sim::Scenario& scenario) {
  return Vector6::Map(scenario.mechanics.range.data());
}

/// From newtons to motion and gestures, as the program does it; and to motion as it were if
/// nothing was held back.
class DeskDevice {
 public:
  explicit DeskDevice(const Vector6& range)
      : zero_(zero_options(range)), gestures_(gesture_options(range)) {}

  GestureResult feel(Sample& sample, const Vector6& noise) noexcept {
    zero_.follow(sample, noise);
    const GestureResult felt = gestures_.feel(sample);
    unheld_ = sample;
    bare_.shape(unheld_);
    if (felt.hold_motion) {
      shaping_.suppress(sample);
    } else {
      shaping_.shape(sample);
    }
    return felt;
  }
  const Vector6& unheld() const noexcept { return unheld_.deflection; }
  const ZeroTracking& zero() const noexcept { return zero_; }

 private:
  static ZeroOptions zero_options(const Vector6& range) {
    ZeroOptions options;
    options.range = range;
    return options;
  }
  static GestureOptions gesture_options(const Vector6& range) {
    GestureOptions options = gestures_for(range);
    int button = 0;
    for (GestureAction* action : {&options.tap, &options.double_tap, &options.press_hold,
                                  &options.twist_left, &options.twist_right}) {
      action->button = button++;
    }
    return options;
  }

  ZeroTracking zero_;
  Gestures gestures_;
  Shaping shaping_{ShapingOptions{}};
  Shaping bare_{ShapingOptions{}};
  Sample unheld_;
};

DeskCount read_an_hour(std::uint64_t seed, DeskReadingOptions options) {
  const sim::Scenario scenario = desk_scenario(seed);
  options.noise = 6e-4 * range_of(scenario);
  DeskReadings readings(scenario, options);
  DeskJudge judge(readings.use());
  DeskDevice device(range_of(scenario));
  double time = 0;
  while (time < 3600) {
    Sample sample = readings.next();
    time = std::chrono::duration<double>(sample.capture_time.time_since_epoch()).count();
    const GestureResult felt = device.feel(sample, options.noise);
    judge.add(time, felt, sample.deflection, device.unheld());
  }
  return judge.count(time);
}

DeskCount said(const char* title, const DeskCount& count) {
  std::printf("%s\n%s", title, report(count).c_str());
  return count;
}

TEST(DeskHour, NoGestureIsFalseAndNoneIsMissed) {
  const DeskCount count = said("60 frames a second", read_an_hour(1, {.fps = 60}));
  EXPECT_GE(count.made(), 200);
  EXPECT_EQ(count.false_gestures, 0);
  EXPECT_EQ(count.missed, 0);
  EXPECT_LT(count.held_sum / count.pushes, 0.010);  // s that a push waits, on average
  EXPECT_LT(count.swept, 0.05 * count.swept_unheld) << "a tap does not jerk the view";
}

TEST(DeskHour, AtThirtyFramesASecondFewAreMissedAndNoneIsFalse) {
  const DeskCount count = said("30 frames a second", read_an_hour(1, {.fps = 30}));
  EXPECT_EQ(count.false_gestures, 0);
  EXPECT_LE(count.missed, 0.03 * count.made());  // taps of 50 ms, whose peak no frame saw
}

TEST(DeskHour, LostAndDoubtfulFramesMakeNoGesture) {
  const DeskCount count =
      said("2 % of 60 frames a second lost, 0.5 % doubtful",
           read_an_hour(3, {.fps = 60, .lost_share = 0.02, .doubtful_share = 0.005}));
  EXPECT_EQ(count.false_gestures, 0);
  EXPECT_LE(count.missed, 0.15 * count.made());
}

TEST(DeskHour, RestIsZeroAndNothingSticks) {
  for (const double fps : {25.0, 60.0, 120.0}) {
    const DeskCount count = read_an_hour(2, {.fps = fps});
    EXPECT_GT(count.at_rest, 900 * fps);
    EXPECT_EQ(count.moving_at_rest, 0) << fps;
    EXPECT_LT(count.longest_motion, 0.5)
        << "s after a touch that ended at " << count.longest_motion_at << " s";
  }
}

double seconds_asked(double otherwise) {
  const char* asked = std::getenv("TAGWRENCH_DESK_SECONDS");
  return asked != nullptr ? std::strtod(asked, nullptr) : otherwise;
}

/// Of this process, kB.
long resident_memory() {
  std::ifstream file("/proc/self/statm");
  long pages = 0;
  file >> pages >> pages;
  return pages * (::sysconf(_SC_PAGESIZE) / 1024);
}

TEST(DeskHour, WithPicturesLikewise) {
  const double length = seconds_asked(60);
  sim::Scenario scenario = desk_scenario(17);  // with a bit of everything at its beginning

  scenario.desk.length = length;
  const sim::DeskUse use(scenario);
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  SimulatorSource source(scenario, /*live=*/false);
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  WrenchEstimator wrench(sensor.wrench);
  DeskDevice device(sensor.wrench.range);
  DeskJudge judge(use);
  int statuses[5] = {};
  long memory = 0;
  double time = 0;
  for (int frame = 0; time < length; ++frame) {
    Frame picture;
    ASSERT_EQ(source.read(picture), ReadStatus::frame);
    const Track track = tracker.track(picture);
    Sample sample{.sequence = picture.sequence, .capture_time = picture.capture_time};
    wrench.estimate(track, sample);
    ++statuses[static_cast<int>(sample.status)];
    const GestureResult felt = device.feel(sample, wrench.noise(track));
    time = std::chrono::duration<double>(source.truth().time).count();
    judge.add(time, felt, sample.deflection, device.unheld());

    if (frame == 1000) memory = resident_memory();
  }
  const DeskCount count = judge.count(time);
  std::printf("%s", report(count).c_str());
  for (int i = 0; i < 5; ++i) std::printf("%s %d  ", name(static_cast<Status>(i)), statuses[i]);
  std::printf("\nmemory grew by %ld kB\n", resident_memory() - memory);
  EXPECT_GE(count.made(), length / 20) << "a scenario without gestures proves nothing";
  EXPECT_EQ(count.false_gestures, 0);
  EXPECT_LE(count.missed, 0.03 * count.made());
  EXPECT_EQ(count.moving_at_rest, 0);
  EXPECT_LT(resident_memory() - memory, 1024);
}

}  // namespace
}  // namespace tagwrench::test
