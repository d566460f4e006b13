// A folder for sockets and profiles, and a sensor that they are for.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {

class ProfileFolder : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
  }

  SensorConfig sensor_ = parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the simulated sensor");

 private:
  test::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

}  // namespace tagwrench::test
