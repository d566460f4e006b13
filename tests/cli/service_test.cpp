// What a service needs of `run`: it waits for the camera, and takes the sensor of this desk.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

bool has_camera_node() {
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().starts_with("video")) return true;
  }
  return false;
}

class Service : public testing::Test {
 protected:
  Service() { ::setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1); }
  ~Service() override {
    ::unsetenv("XDG_CONFIG_HOME");
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  /// The socket that a service's messages come to.
  UniqueFd play_systemd() const {
    UniqueFd systemd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = folder_ / "notify";
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(systemd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
    return systemd;
  }
  TemporaryFolder folder_;
};

/// Waits until the service has said this, a minute for each message at most.
bool hears(const UniqueFd& systemd, const std::string& message) {
  constexpr int kPatience_ms = 60'000;
  char text[1024];
  for (pollfd entry{systemd.get(), POLLIN, 0}; ::poll(&entry, 1, kPatience_ms) > 0;) {
    const ssize_t size = ::recv(systemd.get(), text, sizeof text, 0);
    if (std::string(text, static_cast<std::size_t>(size)) == message) return true;
  }
  return false;
}

TEST_F(Service, WithoutACameraItWaitsAndSaysSoUntilItIsStopped) {
  if (has_camera_node()) GTEST_SKIP() << "there is a camera";
  Bridge run({"run", "--wait", "--output", "jsonl:-"});
  ASSERT_TRUE(run.wait_for_message("waiting for a camera that sees the tags"));
  run.signal(SIGTERM);
  const Outcome outcome = run.finish();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out, "") << "nobody is shown the simulated sensor";
}

TEST_F(Service, ACameraThatIsNamedIsWaitedForToo) {
  Bridge run({"run", "--wait", "--source", "v4l2:/dev/video-of-nobody", "--output", "jsonl:-"});
  ASSERT_TRUE(run.wait_for_message("waiting"));
  EXPECT_NE(run.err().find("/dev/video-of-nobody"), std::string::npos) << run.err();
  run.signal(SIGTERM);
  EXPECT_EQ(run.finish().status, 0);
}

TEST_F(Service, AMistakeIsNoReasonToWait) {
  write_file(folder_ / "bad.yaml", "camera: {widht: 3}\n");
  EXPECT_EQ(run_bridge({"run", "--wait", "--sensor", folder_ / "bad.yaml"}).status, 2);
  EXPECT_EQ(run_bridge({"run", "--wait", "--source", "v4l2:/dev/video0,x"}).status, 2);
}

TEST_F(Service, TheSensorOfThisDeskIsTakenForCamerasOnly) {
  std::filesystem::create_directory(folder_ / "tagwrench");
  write_file(folder_ / "tagwrench" / "sensor.yaml", "camera: {widht: 3}\n");
  const Outcome camera = run_bridge({"run", "--source", "v4l2:/dev/video-of-nobody"});
  EXPECT_EQ(camera.status, 2);
  EXPECT_NE(camera.err.find("tagwrench/sensor.yaml"), std::string::npos) << camera.err;
  EXPECT_NE(camera.err.find("widht"), std::string::npos) << camera.err;
  EXPECT_EQ(run_bridge({"run", "--source", "sim", "--output", "jsonl:-", "--fast", "--frames", "3"})
                .status,
            0);
}

TEST_F(Service, SystemdIsToldWhenItRunsAndWhenItEnds) {
  const UniqueFd systemd = play_systemd();
  const Outcome outcome =
      run_bridge({"run", "--source", "sim", "--output", "jsonl:-", "--fast", "--frames", "3"});
  EXPECT_EQ(outcome.status, 0);
  std::string told;
  char text[1024];
  for (ssize_t size; (size = ::recv(systemd.get(), text, sizeof text, MSG_DONTWAIT)) > 0;)
    told.append(text, static_cast<std::size_t>(size)) += '\n';
  EXPECT_TRUE(told.starts_with("READY=1\nSTATUS=source: ")) << told;
  EXPECT_TRUE(told.ends_with("STOPPING=1\n")) << told;
}

TEST_F(Service, GivesSignsOfLifeWhileItWaitsAndWhileItRuns) {
  const UniqueFd systemd = play_systemd();
  ::setenv("WATCHDOG_USEC", "200000", 1);
  for (const char* source : {"v4l2:/dev/video-of-nobody", "sim"}) {
    Bridge run(
        {"run", "--wait", "--source", source, "--output", "jsonl:" + (folder_ / "out").string()});
    EXPECT_TRUE(hears(systemd, "WATCHDOG=1")) << source;
    EXPECT_TRUE(hears(systemd, "WATCHDOG=1")) << source;
    run.signal(SIGTERM);
    EXPECT_EQ(run.finish().status, 0) << source;
    EXPECT_TRUE(hears(systemd, "STOPPING=1")) << source;
  }
}

}  // namespace
}  // namespace tagwrench::test
