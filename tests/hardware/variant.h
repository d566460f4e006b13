// The variant that ctest names in the environment, exported before by hardware/export.py.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/hardware/drawn_sensor.h"

namespace tagwrench::test {

class Variant : public testing::Test {
 protected:
  void SetUp() override {
    if (yaml().empty()) GTEST_SKIP() << "run by ctest, which names the variant";
    if (const std::string missing = missing_tool({"openscad", "prusa-slicer", "admesh"});
        !missing.empty())
      GTEST_SKIP() << missing;
    if (!sensor_) sensor_ = std::make_unique<DrawnSensor>(yaml(), folder());
  }
  static void TearDownTestSuite() { sensor_.reset(); }

  static std::string yaml() { return from_environment("TAGWRENCH_VARIANT"); }
  static std::string folder() { return from_environment("TAGWRENCH_VARIANT_FOLDER"); }
  static const DrawnSensor& sensor() { return *sensor_; }
  static const hardware::Parameters& parameters() { return sensor_->parameters; }
  static const hardware::Geometry& geometry() { return sensor_->geometry; }

 private:
  static std::string from_environment(const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
  }

  inline static std::unique_ptr<DrawnSensor> sensor_;
};

}  // namespace tagwrench::test
