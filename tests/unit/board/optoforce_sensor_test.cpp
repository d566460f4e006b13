#include <gtest/gtest.h>

#include <filesystem>

#include "host/board/optoforce.h"
#include "host/core/config_error.h"
#include "optoforce_frames.h"
#include "pty.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

class OptoforceSensorTest : public ::testing::Test {
 protected:
  OptoforceSensorTest() { plug(); }
  void plug() {
    device.open();
    fs::remove(port());
    fs::create_symlink(device.path(), port());
  }
  std::string port() const { return (folder / "force").string(); }
  OptoforceOptions options() const {
    OptoforceOptions out;
    out.port = port();
    out.counts_per_unit = {100, 100, 20, 5000, 5000, 8000};
    return out;
  }

  /// Sends a frame now and then until a reading comes; false if none does within 20 s.
  bool wait_for_reading(OptoforceSensor& sensor, OptoforceReading& reading) {
    for (int i = 0; i < 10'000; ++i) {
      ::poll(nullptr, 0, 2);  // the sensor's own pace
      if (device.fd() >= 0)
        device.write(optoforce_frame(counter++, 0, {100, -200, 10, 5000, 0, 8}));
      readable(sensor.poll_fd(), 10);
      sensor.service();
      if (sensor.next(reading)) return true;
    }
    return false;
  }

  test::TemporaryFolder temporary_;
  fs::path folder = temporary_.path();
  Pty device;
  std::uint16_t counter = 0;
};

TEST_F(OptoforceSensorTest, IsConfiguredAndItsCountsBecomeNewtons) {
  OptoforceSensor sensor(options());
  ASSERT_TRUE(readable(device.fd()));
  const Bytes command = device.read();
  EXPECT_EQ(command, (Bytes{0xAA, 0x00, 0x32, 0x03, 0x0A, 0x04, 0x00, 0x00, 0xED}));
  OptoforceReading reading;
  ASSERT_TRUE(wait_for_reading(sensor, reading));
  EXPECT_EQ(reading.axes, 6);
  EXPECT_DOUBLE_EQ(reading.values[0], 1.0);
  EXPECT_DOUBLE_EQ(reading.values[1], -2.0);
  EXPECT_DOUBLE_EQ(reading.values[2], 0.5);
  EXPECT_DOUBLE_EQ(reading.values[3], 1.0);
  EXPECT_DOUBLE_EQ(reading.values[5], 1e-3);
  EXPECT_GT(reading.time.time.time_since_epoch().count(), 0);
}

TEST_F(OptoforceSensorTest, WhatWaitedSinceLongAgoIsNotShown) {
  OptoforceSensor sensor(options());
  for (std::uint16_t i = 0; i < 50; ++i)  // the backlog of an adapter, right after opening
    device.write(optoforce_frame(i, 0, {9999, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(readable(sensor.poll_fd()));
  sensor.service();
  OptoforceReading reading;
  EXPECT_FALSE(sensor.next(reading));
  counter = 50;
  ASSERT_TRUE(wait_for_reading(sensor, reading));
  EXPECT_DOUBLE_EQ(reading.values[0], 1.0);
}

TEST_F(OptoforceSensorTest, UnpluggedItComesBack) {
  OptoforceSensor sensor(options());
  OptoforceReading reading;
  ASSERT_TRUE(wait_for_reading(sensor, reading));
  device.unplug();
  while (sensor.plugged()) {
    readable(sensor.poll_fd(), 100);
    sensor.service();
  }
  EXPECT_EQ(sensor.poll_fd(), -1);
  plug();
  while (sensor.next(reading)) {
  }
  EXPECT_TRUE(wait_for_reading(sensor, reading));
}

TEST_F(OptoforceSensorTest, ScalesThatCannotBeAreRefused) {
  for (const std::vector<double>& wrong : {std::vector<double>{},
                                           {1, 2},
                                           {1, 2, 0},
                                           {1, 2, std::numeric_limits<double>::quiet_NaN()}}) {
    OptoforceOptions given = options();
    given.counts_per_unit = wrong;
    EXPECT_THROW(OptoforceSensor{given}, ConfigError);
  }
}

}  // namespace
}  // namespace tagwrench::link
