#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "host/board/serial_port.h"
#include "host/core/config_error.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

TEST(UsbIdentityTest, IsReadFromItsText) {
  EXPECT_FALSE(parse_usb_identity("/dev/ttyUSB0"));
  const auto any = parse_usb_identity("usb:1a86:7523");
  ASSERT_TRUE(any);
  EXPECT_EQ(any->vendor, 0x1a86);
  EXPECT_EQ(any->product, 0x7523);
  EXPECT_EQ(any->serial, "");
  EXPECT_EQ(parse_usb_identity("usb:2341:0043:7543:931")->serial, "7543:931");
  for (const char* wrong : {"usb:", "usb:1a86", "usb:1a86:", "usb::7523", "usb:1a86:75230",
                            "usb:1a86:75x3", "usb:-1:7523", "usb: 1a86:7523"}) {
    EXPECT_THROW(parse_usb_identity(wrong), ConfigError) << wrong;
  }
}

TEST(UsbIdentityTest, KnownBoardsHaveNames) {
  EXPECT_EQ(usb_board_name(0x2341, 0x0043), "Arduino Uno R3");
  EXPECT_EQ(usb_board_name(0xDEAD, 0xBEEF), "");
}

/// A sysfs of our own: tty class links into device folders, as the kernel lays them out.
class UsbTreeTest : public ::testing::Test {
 protected:
  UsbTreeTest() { fs::create_directories(root / "class/tty"); }

  void plug(const std::string& bus_port, const std::string& vendor, const std::string& product,
            const std::string& serial, const std::string& tty) const {
    const fs::path device = root / "devices/pci0000:00/usb1" / bus_port;
    const fs::path interface = device / (bus_port + ":1.0");
    fs::create_directories(interface / "tty" / tty);
    std::ofstream(device / "idVendor") << vendor << '\n';
    std::ofstream(device / "idProduct") << product << '\n';
    if (!serial.empty()) std::ofstream(device / "serial") << serial << '\n';
    fs::create_symlink(interface, interface / "tty" / tty / "device");
    fs::create_symlink(interface / "tty" / tty, root / "class/tty" / tty);
  }
  test::TemporaryFolder temporary_;
  fs::path root = temporary_.path();
};

TEST_F(UsbTreeTest, TheNodeIsFoundByVendorProductAndSerial) {
  plug("1-1", "1a86", "7523", "", "ttyUSB0");
  plug("1-2.4", "2341", "0043", "7543931", "ttyACM0");
  plug("1-3", "2341", "0043", "999", "ttyACM1");
  fs::create_directories(root / "class/tty/tty0");  // a console: no USB device above it
  using Nodes = std::vector<std::string>;
  EXPECT_EQ(usb_serial_nodes({0x1a86, 0x7523, ""}, root), Nodes{"/dev/ttyUSB0"});
  EXPECT_EQ(usb_serial_nodes({0x2341, 0x0043, "999"}, root), Nodes{"/dev/ttyACM1"});
  EXPECT_EQ(usb_serial_nodes({0x2341, 0x0043, ""}, root), (Nodes{"/dev/ttyACM0", "/dev/ttyACM1"}));
  EXPECT_EQ(usb_serial_nodes({0x2341, 0x0001, ""}, root), Nodes{});
  EXPECT_EQ(usb_serial_nodes({0x2341, 0x0043, "998"}, root), Nodes{});
}

TEST_F(UsbTreeTest, ATreeWithoutSerialPortsHasNone) {
  EXPECT_TRUE(usb_serial_nodes({1, 2, ""}, root).empty());
  EXPECT_TRUE(usb_serial_nodes({1, 2, ""}, root / "nowhere").empty());
}

TEST(UsbIdentityTest, ABoardThatIsNotPluggedInIsSaidByName) {
  try {
    find_usb_port({0x2341, 0x0043, "no such serial number"});
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("2341:0043 (Arduino Uno R3)"), std::string::npos)
        << e.what();
    EXPECT_NE(std::string(e.what()).find("is not plugged in"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("plug it in"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace tagwrench::link
