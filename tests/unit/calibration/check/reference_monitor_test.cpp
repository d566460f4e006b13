#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "host/calibration/check/in_situ.h"

namespace tagwrench {
namespace {

struct Instrument {
  double scale = 1;
  double zero = 0;          ///< N along the line
  double excitation = 0.5;  ///< N
  double other = 0;         ///< N of other loads, across the line
  double spikes = 0;        ///< share of pairs that are far off
};

Vector6 monitored_range() { return (Vector6() << 1, 1, 3, 0.02, 0.02, 0.01).finished(); }
/// Down, 5 mm off in x.
Vector6 line() { return (Vector6() << 0, 0, -1, 0, 5e-3, 0).finished(); }

std::vector<ReferenceFault> play(ReferenceMonitor& monitor, const Instrument& sensor, double from,
                                 double to) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<ReferenceFault> said;
  for (double t = from; t < to; t += 0.04) {
    const double force = sensor.excitation * (1 + std::sin(2 * M_PI * 0.3 * t));
    Vector6 wrench = line() * (sensor.scale * force + sensor.zero);
    wrench[0] += sensor.other * std::sin(2 * M_PI * 0.17 * t);
    for (int i = 0; i < 6; ++i) wrench[i] += 1e-3 * monitored_range()[i] * normal(random);
    if (uniform(random) < sensor.spikes) wrench += 0.2 * line();
    const ReferenceFault fault =
        monitor.add(TimePoint(Duration(std::llround(t * 1e9))), wrench, line(), monitored_range(),
                    force + 0.5e-3 * normal(random));
    if (fault != ReferenceFault::none) said.push_back(fault);
  }
  return said;
}

using Said = std::vector<ReferenceFault>;

TEST(ReferenceMonitor, SaysNothingWhileAllIsWell) {
  ReferenceMonitor monitor;
  EXPECT_EQ(play(monitor, {}, 0, 600), Said{});
  EXPECT_NEAR(monitor.scale(), 1, 2e-3);
  EXPECT_LT(monitor.scale_sigma(), 3e-3);
  EXPECT_NEAR(monitor.zero(), 0, 2e-3);  // N
}

TEST(ReferenceMonitor, FindsAScaleErrorOfThreePercentAndSaysItOnce) {
  for (const double scale : {0.97, 1.03, -1.0}) {
    ReferenceMonitor monitor;
    EXPECT_EQ(play(monitor, {.scale = scale}, 0, 300), Said{ReferenceFault::scale});
    EXPECT_NEAR(monitor.scale(), scale, 2e-3);
  }
}

TEST(ReferenceMonitor, AScaleThatChangesIsFoundWithinAMinute) {
  ReferenceMonitor monitor;
  EXPECT_EQ(play(monitor, {}, 0, 300), Said{});
  EXPECT_EQ(play(monitor, {.scale = 1.05}, 300, 360), Said{ReferenceFault::scale});
}

TEST(ReferenceMonitor, FindsAZeroThatHasDrifted) {
  ReferenceMonitor monitor;
  EXPECT_EQ(play(monitor, {.zero = 0.08}, 0, 300), Said{ReferenceFault::zero});
  EXPECT_NEAR(monitor.zero(), 0.08, 2e-3);  // N
}

TEST(ReferenceMonitor, ForcesThatHardlyVaryTellNothingOfTheScale) {
  ReferenceMonitor monitor;
  EXPECT_EQ(play(monitor, {.scale = 0.9, .excitation = 0.02}, 0, 300), Said{});
}

TEST(ReferenceMonitor, OtherLoadsAreNotComparedAndSpikesNotBelieved) {
  ReferenceMonitor monitor;
  EXPECT_EQ(play(monitor, {.other = 0.5}, 0, 300), Said{});
  EXPECT_NEAR(monitor.scale(), 1, 0.01);
  ReferenceMonitor spiky;
  EXPECT_EQ(play(spiky, {.spikes = 0.02}, 0, 300), Said{});
  EXPECT_NEAR(spiky.scale(), 1, 0.01);
}

TEST(ReferenceMonitor, WithoutARangeOrWithNumbersThatAreNoneItIsSilent) {
  ReferenceMonitor monitor;
  const Vector6 unknown = Vector6::Constant(1e9);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(monitor.add(TimePoint(std::chrono::milliseconds(40 * i)), 2 * line(), line(), unknown,
                          i % 7),
              ReferenceFault::none);
    EXPECT_EQ(monitor.add(TimePoint(std::chrono::milliseconds(40 * i)), 2 * line(), line(),
                          monitored_range(), std::nan("")),
              ReferenceFault::none);
  }
}

}  // namespace
}  // namespace tagwrench
