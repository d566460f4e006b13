#include "host/source/simulator/simulator_source.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

/// Renders quickly: what is tested is the clock.
sim::Scenario small(double frame_rate) {
  sim::Scenario s;
  s.camera.width_px = 160;
  s.camera.height_px = 120;
  s.camera.fx_px = s.camera.fy_px = 201;
  s.camera.cx_px = 79.5;
  s.camera.cy_px = 59.5;
  s.camera.frame_rate = frame_rate;
  return s;
}

bool readable(int fd) {
  pollfd wait{fd, POLLIN, 0};
  return ::poll(&wait, 1, 5000) == 1;
}

void wait_for(Duration length) {
  const UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
  itimerspec when{};
  when.it_value.tv_nsec = length.count();
  ASSERT_EQ(::timerfd_settime(timer.get(), 0, &when, nullptr), 0);
  std::uint64_t ticks = 0;
  ASSERT_EQ(::read(timer.get(), &ticks, sizeof ticks), static_cast<ssize_t>(sizeof ticks));
}

TEST(SimulatorSource, VirtualClockNeverDropsAndTicksEvenly) {
  SimulatorSource source(small(40), false);
  EXPECT_EQ(source.poll_fd(), -1);
  EXPECT_EQ(source.format().period, Duration(25'000'000));
  for (std::uint64_t i = 0; i < 20; ++i) {
    Frame frame;
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    EXPECT_EQ(frame.sequence, i);
    EXPECT_EQ(frame.dropped, 0U);
    EXPECT_EQ(frame.capture_time.time_since_epoch(),
              Duration(25'000'000 * static_cast<std::int64_t>(i)));
    EXPECT_EQ(source.truth().sequence, i);
  }
}

TEST(SimulatorSource, RestComesFirstThenTheWrench) {
  SimulatorSource source(small(25), false);
  Frame frame;
  for (int i = 0; i <= 37; ++i) {  // 1.48 s
    source.read(frame);
    ASSERT_EQ(source.truth().displacement, Vector6::Zero());
    ASSERT_EQ(source.truth().wrench, Vector6::Zero());
  }
  for (int i = 0; i < 40; ++i) source.read(frame);
  EXPECT_GT(source.truth().wrench.head<3>().norm(), 0.05);
  EXPECT_GT(source.truth().displacement.head<3>().norm(), 20e-6);
}

TEST(SimulatorSource, LiveSourceDropsWhatNobodyReadAndShowsTheNewest) {
  SimulatorSource source(small(200), true);
  ASSERT_GE(source.poll_fd(), 0);
  wait_for(std::chrono::milliseconds(60));  // twelve periods
  Frame first;
  ASSERT_EQ(source.read(first), ReadStatus::frame);
  EXPECT_GE(first.dropped, 10U);
  EXPECT_EQ(first.sequence, first.dropped);
  EXPECT_EQ(first.latency_origin, first.capture_time);
  const std::uint64_t sequence = first.sequence;
  const TimePoint time = first.capture_time;
  // The truth is that of the newest instant.
  EXPECT_EQ(source.truth().time, Duration(5'000'000 * static_cast<std::int64_t>(sequence)));

  ASSERT_TRUE(readable(source.poll_fd()));
  Frame second;
  ASSERT_EQ(source.read(second), ReadStatus::frame);
  EXPECT_EQ(second.sequence, sequence + 1 + second.dropped);
  EXPECT_EQ(second.capture_time - time,
            Duration(5'000'000 * static_cast<std::int64_t>(second.sequence - sequence)));
}

TEST(SimulatorSource, LiveCaptureTimesAreTicksOfTheMonotonicClock) {
  const TimePoint before = std::chrono::steady_clock::now();
  SimulatorSource source(small(100), true);
  ASSERT_TRUE(readable(source.poll_fd()));
  Frame frame;
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_GT(frame.capture_time, before);
  EXPECT_LE(frame.capture_time, std::chrono::steady_clock::now());
}

TEST(SimulatorSource, LiveReadBeforeTheTickGivesNothing) {
  SimulatorSource source(small(1), true);
  Frame frame;
  EXPECT_EQ(source.read(frame), ReadStatus::nothing);
}

TEST(SimulatorSource, LargerFormatsRender) {
  sim::Scenario s;
  s.camera.width_px = 1920;
  s.camera.height_px = 1080;
  s.camera.fx_px = s.camera.fy_px = 1811.25;
  s.camera.cx_px = 959.5;
  s.camera.cy_px = 539.5;
  SimulatorSource source(s, false);
  Frame frame;
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.image.width, 1920);
  EXPECT_EQ(frame.image.height, 1080);
}

TEST(SimulatorSource, WildMotionStaysInsideOfItsMemory) {
  sim::Scenario s = small(25);
  s.trajectory.rest_time = 0;
  s.trajectory.amplitude = {20, 20, 60, 1,
                            1,  1};  // the platform leaves the picture, tips over and hits the lens
  SimulatorSource source(s, false);
  Frame frame;
  for (int i = 0; i < 60; ++i) EXPECT_EQ(source.read(frame), ReadStatus::frame);
}

TEST(SimulatorSource, RefusesAScenarioInOneLine) {
  sim::Scenario s;
  s.mechanics.mass = -1;
  try {
    SimulatorSource source(s, false);
    FAIL() << "accepted a negative mass";
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "scenario: mechanics.mass_g must lie between 0.01 and 10000, is -1000");
  }
}

}  // namespace
}  // namespace tagwrench
