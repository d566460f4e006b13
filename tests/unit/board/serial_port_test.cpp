#include "host/board/serial_port.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>

#include "host/core/config_error.h"
#include "pty.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::string& path, unsigned baud = 500'000) {
  try {
    SerialPort port(path, baud);
  } catch (const ConfigError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return {};
}

TEST(SerialPortTest, BytesGoBothWaysUnchanged) {
  Pty device;
  SerialPort port(device.path(), 500'000);
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(port.write(all));
  ASSERT_TRUE(readable(device.fd()));
  EXPECT_EQ(device.read(), all);
  device.write(all);
  ASSERT_TRUE(readable(port.fd()));
  std::vector<std::uint8_t> room(1000);
  const SerialPort::ReadResult got = port.read(room);
  room.resize(got.count);
  EXPECT_EQ(room, all);
  EXPECT_FALSE(got.gone);
  EXPECT_EQ(port.read(room).count, 0u) << "nothing there is no wait and no end";
  EXPECT_TRUE(port);
}

TEST(SerialPortTest, WhatCameBeforeOpeningIsThrownAway) {
  Pty device;
  {
    SerialPort first(device.path(), 500'000);
    device.write("old");
    ASSERT_TRUE(readable(first.fd()));
    first.flush_input();
    std::vector<std::uint8_t> room(10);
    EXPECT_EQ(first.read(room).count, 0u);
  }
}

TEST(SerialPortTest, AnUnpluggedDeviceIsAStatus) {
  Pty device;
  SerialPort port(device.path(), 500'000);
  device.unplug();
  ASSERT_TRUE(readable(port.fd()));
  std::vector<std::uint8_t> room(10);
  EXPECT_TRUE(port.read(room).gone);
  EXPECT_FALSE(port);
  EXPECT_FALSE(port.write(room));
  EXPECT_TRUE(port.read(room).gone);
}

TEST(SerialPortTest, BytesWithoutRoomAreCountedAndNotWaitedFor) {
  Pty device;
  SerialPort port(device.path(), 500'000);
  const std::vector<std::uint8_t> much(64 * 1024, 0x55);
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(port.write(much));
  EXPECT_GT(port.dropped_bytes(), 100'000u);
}

TEST(SerialPortTest, ASecondHostIsToldWhoHasThePort) {
  Pty device;
  const int ready = 1;
  int to_parent[2];
  int to_child[2];
  ASSERT_EQ(::pipe(to_parent), 0);
  ASSERT_EQ(::pipe(to_child), 0);
  const pid_t child = ::fork();
  if (child == 0) {  // the first host
    SerialPort port;
    const bool open = !port.open(device.path().c_str(), 500'000);
    int done = 0;
    if (::write(to_parent[1], &open, 1) == 1)
      done = static_cast<int>(::read(to_child[0], &done, 1));
    ::_exit(open ? 0 : 1);
  }
  bool open = false;
  ASSERT_EQ(::read(to_parent[0], &open, 1), 1);
  EXPECT_TRUE(open);
  const std::string message = refusal(device.path());
  std::string self;
  std::ifstream("/proc/self/comm") >> self;
  EXPECT_NE(message.find("in use by " + self + " (process " + std::to_string(child) + ")"),
            std::string::npos)
      << message;
  ASSERT_EQ(::write(to_child[1], &ready, 1), 1);
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(refusal(device.path()), "");
}

TEST(SerialPortTest, AnOrdinaryUserMayOpenAPseudoTerminalAgain) {
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;  // root may open what is exclusive
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) ::_exit(3);
    Pty device;
    for (int i = 0; i < 2; ++i) {
      SerialPort port;
      if (port.open(device.path().c_str(), 500'000)) ::_exit(1 + i);
    }
    ::_exit(0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0) << "1: the first time, 2: the second, 3: no other user";
}

TEST(SerialPortTest, WhatIsNoSerialPortIsRefused) {
  EXPECT_NE(refusal("/dev/null").find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal("/etc/hostname").find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal("/tmp").find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal("/dev/ttyNOPE7").find("there is no such port"), std::string::npos);
}

TEST(SerialPortTest, ABaudRateThatIsNotToBeHadIsRefused) {
  Pty device;
  EXPECT_NE(refusal(device.path(), 12'345).find("does not do 12345 baud"), std::string::npos);
  EXPECT_EQ(refusal(device.path(), 1'000'000), "");
}

TEST(SerialPortTest, NoPermissionNamesTheRemedyThatHelps) {
  const std::string path = (fs::temp_directory_path() / "tagwrench-port").string();
  std::ofstream(path) << "";
  const bool root = ::geteuid() == 0;
  ASSERT_EQ(::chown(path.c_str(), ~0u, root ? ::getgrnam("dialout")->gr_gid : ::getegid()), 0);
  struct stat about {};
  ASSERT_EQ(::stat(path.c_str(), &about), 0);
  ASSERT_EQ(::chmod(path.c_str(), 0620), 0);
  const std::string owner = ::getpwuid(about.st_uid)->pw_name;
  const std::string owners = text({SerialFailure::Kind::denied, EACCES}, path, 500'000);
  EXPECT_NE(owners.find("only its owner " + owner + " may open it: `sudo chown $USER " + path),
            std::string::npos)
      << owners;
  ASSERT_EQ(::chmod(path.c_str(), 0660), 0);
  const std::string group = ::getgrgid(about.st_gid)->gr_name;
  const std::string message = text({SerialFailure::Kind::denied, EACCES}, path, 500'000);
  EXPECT_NE(message.find("group " + group), std::string::npos) << message;
  EXPECT_NE(message.find("sudo usermod -aG " + group + " $USER"), std::string::npos) << message;
  fs::remove(path);
}

TEST(SerialPortTest, NoPermissionOnARealPort) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may open everything";
  Pty device;
  ASSERT_EQ(::chmod(device.path().c_str(), 0), 0);
  EXPECT_NE(refusal(device.path()).find("no permission"), std::string::npos);
}

class PlacesTest : public ::testing::Test {
 protected:
  std::string add(const std::string& name) const {
    fs::create_symlink("/dev/null", folder / name);
    return (folder / name).string();
  }
  std::string refused() const {
    try {
      return only_port("--board", folder.string());
    } catch (const ConfigError& e) {
      return e.what();
    }
  }
  test::TemporaryFolder temporary_;
  fs::path folder = temporary_.path();
};

TEST_F(PlacesTest, TheOnlyPortIsTaken) {
  const std::string one = add("usb-1a86_USB_Serial-if00-port0");
  EXPECT_EQ(only_port("--port", folder.string()), one);
}

TEST_F(PlacesTest, NoneAndTwoAreRefusedAndTwoAreListed) {
  EXPECT_NE(refused().find("plug the board in, or give --board"), std::string::npos);
  const std::string a = add("usb-a");
  const std::string b = add("usb-b");
  EXPECT_NE(refused().find(a + ", " + b), std::string::npos) << refused();
  EXPECT_NE(port_advice("--board", folder.string()).find("give --board one of: " + a),
            std::string::npos);
}

}  // namespace
}  // namespace tagwrench::link
