// `tagwrench tune` as a user has it: a terminal, and a sensor that runs and is pushed steadily.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cmath>
#include <cstring>

#include "host/desk/control_socket.h"
#include "host/desk/live.h"
#include "tests/cli/bridge.h"
#include "tests/cli/on_terminal.h"

namespace tagwrench::test {
namespace {

constexpr const char* kRightArrow = "\x1b[C";

class Tune : public testing::Test {
 protected:
  Tune() {
    ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    // Windows of whoever runs this choose nothing here.
    for (const char* desktop : {"SWAYSOCK", "I3SOCK", "WAYLAND_DISPLAY", "DISPLAY"})
      ::unsetenv(desktop);
    write_file(folder_ / "push.yaml",
               "trajectory: {motion: push, axis: fx, share: 0.5, rest_s: 1.5}\n");
    write_file(folder_ / "mine.yaml", kMine);
  }

  /// What is pushed is what moves: nothing is smoothed, filled or held back.
  static constexpr const char* kMine =
      "# straight\n"
      "name: mine   # of mine\n"
      "axes: {x: {full_scale_n: 1, dead_zone_n: 0}}\n"
      "noise_sigmas: 0\n"
      "swing_ms: 0\n"
      "filter: {kind: none}\n"
      "fill: none\n";

  std::string path(const std::string& name) const { return folder_ / name; }
  std::vector<std::string> run(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {"run",       "--source", "sim:" + path("push.yaml"),
                                    "--seconds", "120",      "--no-zero-tracking",
                                    "--output",  "jsonl:-"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  static LiveReading reading() {
    const auto now = parse_live(ask(control_path("sensor"), "live"));
    EXPECT_TRUE(now);
    return now.value_or(LiveReading{});
  }
  /// Motion along x for each newton.
  static double gain() {
    const LiveReading now = reading();
    return now.motion[0] / now.wrench[0];
  }
  /// Until the steady push has been there for a while.
  static void await_push(Bridge& sensor) {
    std::ptrdiff_t lines = 50;
    while (sensor.wait_for_lines(lines) && std::abs(reading().wrench[0]) < 0.1) ++lines;
  }
  /// A frame later what has been said has been shaped.
  static void await_frame(Bridge& sensor) {
    sensor.has_lines(0);
    sensor.wait_for_lines(static_cast<std::ptrdiff_t>(lines_in(sensor.out())) + 2);
  }

  TemporaryFolder folder_;
};

TEST_F(Tune, WhatASliderSaysIsFeltAtOnceAndSavedOnDemand) {
  Bridge sensor(run({"--profile", path("mine.yaml")}));
  await_push(sensor);
  EXPECT_NEAR(gain(), 1, 1e-4);
  OnTerminal tune({"tune"});
  ASSERT_TRUE(tune.shows("sensitivity, translation                      1 ")) << tune.all();
  ASSERT_TRUE(tune.shows("Fx    0.2")) << "the live bars";
  tune.type(std::string(kRightArrow) + kRightArrow);
  ASSERT_TRUE(tune.shows("  1.21 [")) << tune.all();
  ASSERT_TRUE(tune.shows("(not saved)"));
  await_frame(sensor);
  EXPECT_NEAR(gain(), 1.21, 1e-4);
  EXPECT_EQ(read_file(path("mine.yaml")), kMine);
  tune.type("s");
  ASSERT_TRUE(tune.shows("saved: " + path("mine.yaml")));
  EXPECT_EQ(read_file(path("mine.yaml")), std::string(kMine) + "translation: 1.21\n");
  tune.type("q");
  EXPECT_EQ(tune.finish(), 0);
  EXPECT_TRUE(tune.restored());
  await_frame(sensor);
  EXPECT_NEAR(gain(), 1.21, 1e-4);
  sensor.signal(SIGINT);
  EXPECT_EQ(sensor.finish().status, 0);
}

TEST_F(Tune, WhatIsNotSavedGoesWithIt) {
  Bridge sensor(run({"--profile", path("mine.yaml")}));
  await_push(sensor);
  {
    OnTerminal left({"tune", "mine"});
    ASSERT_TRUE(left.shows("  1 ["));
    left.type(kRightArrow);
    ASSERT_TRUE(left.shows("  1.1 ["));
    left.type("q");
    ASSERT_TRUE(left.shows("not saved yet"));
    left.type("q");
    EXPECT_EQ(left.finish(), 0);
    await_frame(sensor);
    EXPECT_NEAR(gain(), 1, 1e-4);
  }
  {
    OnTerminal ended({"tune"});
    ASSERT_TRUE(ended.shows("  1 ["));
    ended.type(kRightArrow);
    ASSERT_TRUE(ended.shows("  1.1 ["));
    ended.signal(SIGTERM);
    EXPECT_EQ(ended.finish(), 0);
    EXPECT_TRUE(ended.restored());
    await_frame(sensor);
    EXPECT_NEAR(gain(), 1, 1e-4);
  }
  OnTerminal killed({"tune"});
  ASSERT_TRUE(killed.shows("  1 ["));
  killed.type(kRightArrow);
  ASSERT_TRUE(killed.shows("  1.1 ["));
  await_frame(sensor);
  EXPECT_NEAR(gain(), 1.1, 1e-4);
  killed.signal(SIGKILL);
  EXPECT_EQ(killed.finish(), 128 + SIGKILL);
  ASSERT_TRUE(sensor.wait_for_message("what was saved is in force again")) << sensor.err();
  await_frame(sensor);
  EXPECT_NEAR(gain(), 1, 1e-4);
  EXPECT_EQ(read_file(path("mine.yaml")), kMine);
}

TEST_F(Tune, AReadyMadeProfileIsSavedUnderANameOfOnesOwn) {
  Bridge sensor(run({"--profile", "cad"}));
  ASSERT_TRUE(sensor.wait_for_lines(30));
  write_file(path("there.yaml"), "name: there\n");
  EXPECT_EQ(run_bridge({"tune", "--out", path("there.yaml")}).status, 2);
  OnTerminal tune({"tune", "--out", path("easy.yaml")});
  ASSERT_TRUE(tune.shows("profile cad"));
  tune.type(kRightArrow);
  ASSERT_TRUE(tune.shows("  1.1 ["));
  tune.type("s");
  ASSERT_TRUE(tune.shows("tagwrench run --profile"));
  tune.type("q");
  EXPECT_EQ(tune.finish(), 0);
  EXPECT_TRUE(sensor.wait_for_message("profile cad: as tuned, until this run ends"));
  sensor.signal(SIGINT);
  EXPECT_EQ(sensor.finish().status, 0);
  EXPECT_NE(read_file(path("easy.yaml")).find("# For turning a view"), std::string::npos);
  const Outcome next = run_bridge({"run", "--source", "sim", "--frames", "3", "--profile",
                                   path("easy.yaml"), "--output", "jsonl:-"});
  EXPECT_EQ(next.status, 0) << next.err;
  EXPECT_EQ(read_file(path("there.yaml")), "name: there\n");
}

TEST_F(Tune, ASensorThatEndsIsToldAndOneThatComesIsTunedOn) {
  auto sensor = std::make_unique<Bridge>(run({"--profile", path("mine.yaml")}));
  ASSERT_TRUE(sensor->wait_for_lines(1));
  OnTerminal tune({"tune"});
  ASSERT_TRUE(tune.shows("  1 ["));
  tune.type(kRightArrow);
  ASSERT_TRUE(tune.shows("  1.1 ["));
  sensor->signal(SIGINT);
  sensor->finish();
  ASSERT_TRUE(tune.shows("the sensor has gone"));
  sensor = std::make_unique<Bridge>(run({"--profile", path("mine.yaml")}));
  await_push(*sensor);
  ASSERT_TRUE(tune.shows("Fx    0.2", "not in force"));
  EXPECT_EQ(tune.screen().find("has gone"), std::string::npos);
  await_frame(*sensor);
  EXPECT_NEAR(gain(), 1.1, 1e-4);
  tune.type("\x03");
  EXPECT_EQ(tune.finish(), 0);
}

TEST_F(Tune, WithoutASensorOrATerminalItSaysWhatIsMissing) {
  const Outcome alone = run_bridge({"tune"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_NE(alone.err.find("start `tagwrench run` first"), std::string::npos) << alone.err;
  Bridge sensor(run({"--profile", path("mine.yaml")}));
  ASSERT_TRUE(sensor.wait_for_lines(1));
  const Outcome piped = run_bridge({"tune"});
  EXPECT_EQ(piped.status, 2);
  EXPECT_NE(piped.err.find("needs a terminal"), std::string::npos) << piped.err;
  EXPECT_EQ(piped.out, "");
  const Outcome unknown = run_bridge({"tune", "chess"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_EQ(unknown.err, "tagwrench: no profile 'chess'; there are mine\n");
}

/// A program of that name on the socket of CAD programs, in a process of its own.
class SpnavProgramProcess {
 public:
  SpnavProgramProcess(const std::string& name, const std::string& socket) : pid_(::fork()) {
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::prctl(PR_SET_NAME, name.c_str());
    const UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
    if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  SpnavProgramProcess(const SpnavProgramProcess&) = delete;
  SpnavProgramProcess& operator=(const SpnavProgramProcess&) = delete;
  ~SpnavProgramProcess() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_;
};

TEST_F(Tune, TheProgramThatConnectedLastAndLivesChoosesTheProfile) {
  Bridge sensor(run({"--profile", path("mine.yaml"), "--profile", "cad", "--profile", "game",
                     "--output", "spnav:" + path("spnav.sock")}));
  ASSERT_TRUE(sensor.wait_for_lines(1)) << sensor.finish().err;
  const SpnavProgramProcess cad("FreeCAD", path("spnav.sock"));
  ASSERT_TRUE(sensor.wait_for_message("profile: cad (FreeCAD)")) << sensor.err();
  {
    const SpnavProgramProcess game("fgfs", path("spnav.sock"));
    ASSERT_TRUE(sensor.wait_for_message("profile: game (fgfs)")) << sensor.err();
  }
  const std::string again = "profile: cad (FreeCAD)";
  const auto times = [&] {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = sensor.err().find(again, at)) != std::string::npos; ++at)
      ++count;
    return count;
  };
  while (times() < 2)
    ASSERT_TRUE(sensor.wait_for_lines(static_cast<std::ptrdiff_t>(lines_in(sensor.out())) + 1));
  EXPECT_EQ(run_bridge({"control", "window", "mail"}).out, "mine\n") << "the window wins";
  const SpnavProgramProcess late("fgfs", path("spnav.sock"));
  ASSERT_TRUE(sensor.wait_for_message("fgfs (process")) << sensor.err();
  await_frame(sensor);
  EXPECT_EQ(run_bridge({"control", "status"}).out, "profile mine of mine cad game\n");
}

}  // namespace
}  // namespace tagwrench::test
