// A folder for sockets and profiles, and a sensor that they are for.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "host/sensor/sensor_config.h"
#include "host/source/simulator/folder_export.h"

namespace tagwrench::test {

class ProfileFolder : public testing::Test {
 protected:
  ProfileFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "desk-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~ProfileFolder() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
  }

  SensorConfig sensor_ = parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the simulated sensor");

 private:
  std::filesystem::path folder_;
};

}  // namespace tagwrench::test
