// Which profile is in force while a sensor runs.
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>

#include "host/core/os/unique_fd.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class ProfileInForce : public testing::Test {
 protected:
  ProfileInForce() {
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
  /// A frame later what has been said has been shaped.
  static void await_frame(Bridge& sensor) {
    sensor.has_lines(0);
    sensor.wait_for_lines(static_cast<std::ptrdiff_t>(lines_in(sensor.out())) + 2);
  }

  TemporaryFolder folder_;
};

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

TEST_F(ProfileInForce, TheProgramThatConnectedLastAndLivesChoosesTheProfile) {
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
