// `run --profile`, `--name` and `tagwrench control`, as a user has them.
#include <gtest/gtest.h>

#include "tests/cli/bridge.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {
namespace {

class Control : public testing::Test {
 protected:
  Control() {
    ::setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
    // Windows of whoever runs this choose nothing here.
    for (const char* desktop : {"SWAYSOCK", "I3SOCK", "WAYLAND_DISPLAY", "DISPLAY"})
      ::unsetenv(desktop);
    // It stays at rest, so that a zero can be had.
    std::ofstream(folder_ / "still.yaml") << "trajectory: {motion: rest}\n";
  }

  std::vector<std::string> run(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {"run", "--source", "sim:" + path("still.yaml"), "--seconds",
                                    "60"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  test::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

TEST_F(Control, ChangesProfileAndZeroOfTheSensorThatRuns) {
  Bridge sensor(
      run({"--profile", "cad", "--profile", "game", "--name", "left", "--output", "jsonl:-"}));
  ASSERT_TRUE(sensor.wait_for_lines(30)) << sensor.finish().err;
  EXPECT_EQ(run_bridge({"control", "--name", "left", "status"}).out, "profile cad of cad game\n");
  EXPECT_EQ(run_bridge({"control", "--name", "left", "next"}).out, "game\n");
  ASSERT_TRUE(sensor.wait_for_message("profile: game (as asked)"));
  const Outcome unknown = run_bridge({"control", "--name", "left", "profile", "chess"});
  EXPECT_EQ(unknown.status, 1);
  EXPECT_EQ(unknown.err, "tagwrench: error: no profile 'chess'; there are cad, game\n");
  EXPECT_EQ(run_bridge({"control", "--name", "left", "zero"}).status, 0);
  ASSERT_TRUE(sensor.wait_for_message("zero: what read is nothing now")) << sensor.err();
  sensor.signal(SIGINT);
  EXPECT_EQ(sensor.finish().status, 0);
  EXPECT_FALSE(std::filesystem::exists(path("tagwrench/left.control")));
}

TEST_F(Control, ASecondDeviceOfTheNameIsRefusedAndTheFirstGoesOn) {
  Bridge sensor(run({"--profile", "cad", "--output", "jsonl:-"}));
  ASSERT_TRUE(sensor.wait_for_lines(1)) << sensor.finish().err;
  const Outcome second = run_bridge(run({"--output", "spacemouse"}));
  EXPECT_EQ(second.status, 2);
  EXPECT_NE(second.err.find("--name sensor: a bridge of this name runs already"), std::string::npos)
      << second.err;
  EXPECT_EQ(run_bridge({"control", "status"}).status, 0);
}

TEST_F(Control, WithoutASensorItSaysWhatToStart) {
  const Outcome alone = run_bridge({"control", "zero"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_NE(alone.err.find("start `tagwrench run` first"), std::string::npos) << alone.err;
}

TEST_F(Control, AProfileWithAMistakeStopsTheRunBeforeItBegins) {
  std::ofstream(folder_ / "mine.yaml") << "name: mine\ncurve: {powr: 2}\n";
  const Outcome wrong = run_bridge(run({"--profile", path("mine.yaml"), "--output", "jsonl:-"}));
  EXPECT_EQ(wrong.status, 2);
  EXPECT_EQ(wrong.out, "");
  EXPECT_NE(wrong.err.find("mine.yaml:2"), std::string::npos) << wrong.err;
  EXPECT_EQ(run_bridge(run({"--name", "a/b", "--output", "jsonl:-"})).status, 2);
}

}  // namespace
}  // namespace tagwrench::test
