// systemd's side of sd_notify(3) is played by a socket of the test.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "host/output/watchdog.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

class ServiceWatchTest : public testing::Test {
 protected:
  ServiceWatchTest() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, (folder_ + "/notify").c_str());
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              0);
    ::setenv("NOTIFY_SOCKET", address.sun_path, 1);
  }
  ~ServiceWatchTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }

  /// What systemd has been told since the last call, empty if nothing.
  std::string told() const {
    char text[1024];
    const ssize_t size = ::recv(socket_.get(), text, sizeof text, MSG_DONTWAIT);
    return size > 0 ? std::string(text, static_cast<std::size_t>(size)) : std::string();
  }

  test::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path();
  UniqueFd socket_{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
};

TEST_F(ServiceWatchTest, ThereIsNoneWithoutSystemd) {
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_EQ(ServiceWatch::open(), nullptr);
}

TEST_F(ServiceWatchTest, TellsThatItIsReadyWhatItDoesAndThatItEnds) {
  std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();
  ASSERT_NE(watch, nullptr);
  EXPECT_EQ(told(), "");
  watch->ready("waiting");
  EXPECT_EQ(told(), "READY=1\nSTATUS=waiting");
  EXPECT_FALSE(watch->notice("the camera is gone")) << "the journal shall have it, too";
  EXPECT_EQ(told(), "STATUS=the camera is gone");
  watch->notice("");
  EXPECT_EQ(told(), "STATUS=running");
  watch.reset();
  EXPECT_EQ(told(), "STOPPING=1");
}

TEST_F(ServiceWatchTest, ALongLineIsCut) {
  ServiceWatch::open()->notice(std::string(5000, 'x'));
  EXPECT_EQ(told().size(), 7u + 200u);
}

TEST_F(ServiceWatchTest, WithoutAWatchdogNobodyNeedsToPoll) {
  EXPECT_EQ(ServiceWatch::open()->poll_fd(), -1);
}

TEST_F(ServiceWatchTest, GivesASignOfLifeWhenItIsServedAndOnlyThen) {
  ::setenv("WATCHDOG_USEC", "40000", 1);
  const std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();
  watch->service();
  EXPECT_EQ(told(), "") << "the time has not come";
  pollfd timer{watch->poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&timer, 1, 60'000), 1);
  EXPECT_EQ(told(), "") << "a loop that hangs gives no sign";
  watch->service();
  EXPECT_EQ(told(), "WATCHDOG=1");
  ASSERT_EQ(::poll(&timer, 1, 60'000), 1);
  watch->service();
  EXPECT_EQ(told(), "WATCHDOG=1");
}

TEST_F(ServiceWatchTest, TheWatchdogOfAnotherProcessIsNotServed) {
  ::setenv("WATCHDOG_USEC", "40000", 1);
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_EQ(ServiceWatch::open()->poll_fd(), -1);
}

}  // namespace
}  // namespace tagwrench
