// `tagwrench camera-timing` as its users run it.
#include <gtest/gtest.h>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

void expect_refused(const Outcome& outcome, int status, const std::vector<std::string>& parts) {
  EXPECT_EQ(outcome.status, status) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
  for (const std::string& part : parts) {
    EXPECT_NE(outcome.err.find(part), std::string::npos)
        << "no '" << part << "' in: " << outcome.err;
  }
}

Outcome camera_timing(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "camera-timing");
  return run_bridge(arguments);
}

TEST(CameraTimingInput, WhatCannotBeIsRefusedInOneLine) {
  expect_refused(camera_timing({"--port", "sim"}), 2, {"--source"});
  expect_refused(camera_timing({"--source", "sim"}), 2, {"--port", "--screen"});
  expect_refused(camera_timing({"--source", "sim", "--port", "sim", "--screen"}), 2, {"--screen"});
  expect_refused(camera_timing({"--source", "sim", "--screen", "tv"}), 2, {"--screen tv", "web"});
  expect_refused(camera_timing({"--source", "sim", "--screen", "web"}), 2,
                 {"--screen web", "sees no screen"});
  expect_refused(camera_timing({"--source", "sim", "--screen", "--web-token", "token"}), 2,
                 {"--web-token", "--screen web"});
  expect_refused(camera_timing({"--source", "v4l2:/dev/video99", "--screen", "web:[]:8137"}), 2,
                 {"--screen web:[]:8137", "ADDRESS:PORT"});
  expect_refused(camera_timing({"--source", "v4l2:/dev/video99", "--port", "sim"}), 2,
                 {"--port sim", "simulated sensor alone"});
  expect_refused(camera_timing({"--source", "sim", "--port", "/dev/ttyUSB99"}), 2, {"--port sim"});
  expect_refused(camera_timing({"--source", "v4l2:/dev/video99", "--port", "/dev/ttyUSB99"}), 2,
                 {"/dev/ttyUSB99"});
  expect_refused(camera_timing({"--source", "v4l2:/dev/video99", "--port", "/dev/null", "--fast"}),
                 2, {"--fast"});
  for (const char* seconds : {"0", "1", "21", "nan", "ten"}) {
    expect_refused(camera_timing({"--source", "sim", "--port", "sim", "--seconds", seconds}), 2,
                   {"--seconds"});
  }
  expect_refused(
      camera_timing({"--source", "sim", "--port", "sim", "--json", "/nonexistent/x.json"}), 2,
      {"--json /nonexistent/x.json"});
}

TEST(CameraTimingInput, AnUnusableSceneSaysWhyAndWritesNothing) {
  const TemporaryFolder temporary;
  write_file(
      temporary / "dark.yaml",
      "light: {level_counts: 2, glare_counts: 0, led_level: 1}\ntrajectory: {motion: rest}\n");
  const Outcome outcome =
      camera_timing({"--source", "sim:" + (temporary / "dark.yaml").string(), "--port", "sim",
                     "--fast", "--json", temporary / "r.json"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("LED does not show"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(temporary / "r.json"));
}

TEST(CameraTimingInput, TheReportComesAsTextOrAsJson) {
  const TemporaryFolder temporary;
  const std::string source = "sim:" TAGWRENCH_SCENARIOS "/camera_timing.yaml";
  const Outcome text = camera_timing({"--source", source, "--port", "sim", "--fast", "--seconds",
                                      "3", "--json", temporary / "r.json"});
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("frame rate     24.87"), std::string::npos) << text.out;
  const std::string json = read_file(temporary / "r.json");
  EXPECT_EQ(json.rfind("{", 0), 0U);
  EXPECT_NE(json.find("\"tagwrench-bandwidth-1\""), std::string::npos);
  const Outcome piped = camera_timing(
      {"--source", source, "--port", "sim", "--fast", "--seconds", "3", "--json", "-"});
  EXPECT_EQ(piped.status, 0) << piped.err;
  EXPECT_EQ(piped.out.rfind("{", 0), 0U) << "data only";
}

TEST(CameraTimingInput, AScreenThatIsNotThereIsSaid) {
  ::unsetenv("DISPLAY");
  ::unsetenv("WAYLAND_DISPLAY");
  ::setenv("SDL_VIDEODRIVER", "x11", 1);
  expect_refused(camera_timing({"--source", "v4l2:/dev/video99", "--screen"}), 2,
                 {"--screen", "DISPLAY"});
}

TEST(CameraTimingInput, CtrlCEndsItWithoutAReport) {
  Bridge bridge({"camera-timing", "--source", "sim:" TAGWRENCH_SCENARIOS "/camera_timing.yaml",
                 "--port", "sim", "--seconds", "20"});
  ASSERT_TRUE(bridge.wait_for_message("LED steady"));
  bridge.signal(SIGINT);
  const Outcome outcome = bridge.finish();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("stopped"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tagwrench::test
