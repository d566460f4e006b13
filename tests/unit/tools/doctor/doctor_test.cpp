#include "host/tools/doctor/doctor.h"

#include <gtest/gtest.h>

#include <sstream>

namespace tagwrench {
namespace {

// The layout of /proc/bus/input/devices.
constexpr const char* kDevices =
    "I: Bus=0011 Vendor=0001 Product=0001 Version=ab41\n"
    "N: Name=\"AT Translated Set 2 keyboard\"\n"
    "H: Handlers=sysrq kbd event0\n"
    "\n"
    "I: Bus=0003 Vendor=256f Product=c635 Version=0111\n"
    "N: Name=\"3Dconnexion SpaceMouse Compact\"\n"
    "\n"
    "I: Bus=0003 Vendor=046d Product=c626 Version=0110\n"
    "N: Name=\"3Dconnexion SpaceNavigator\"\n"
    "\n"
    "I: Bus=0003 Vendor=046d Product=c52b Version=0111\n"
    "N: Name=\"Logitech USB Receiver\"\n"
    "\n"
    "I: Bus=0003 Vendor=046d Product=c627 Version=0111\n"
    "N: Name=\"Space Explorer\"\n"
    "\n"
    "I: Bus=0003 Vendor=256f Product=c62e Version=0000\n"
    "N: Name=\"tagwrench 3Dconnexion SpaceMouse\"\n"
    "\n"
    "I: Bus=0006 Vendor=1209 Product=0001 Version=0000\n"
    "N: Name=\"3Dconnexion look-alike\"\n";

TEST(Doctor, FindsTheDevicesThatWinOverOurs) {
  const auto devices = other_6dof_devices(kDevices);
  ASSERT_EQ(devices.size(), 4U);
  EXPECT_EQ(devices[0].name, "3Dconnexion SpaceMouse Compact");
  EXPECT_EQ(devices[0].vendor, 0x256fU);
  EXPECT_EQ(devices[0].product, 0xc635U);
  EXPECT_EQ(devices[1].name, "3Dconnexion SpaceNavigator");
  EXPECT_EQ(devices[2].name, "Space Explorer");
  EXPECT_EQ(devices[3].name, "3Dconnexion look-alike");
}

TEST(Doctor, ADamagedListIsNoHarm) {
  EXPECT_TRUE(other_6dof_devices("").empty());
  EXPECT_TRUE(other_6dof_devices("I: Vendor=\nN: Name=").empty());
  EXPECT_TRUE(other_6dof_devices("N: Name=\"").empty());
  EXPECT_TRUE(other_6dof_devices("I: Vendor=zz Product=\nN: Name=x").empty());
}

TEST(Doctor, EveryLineIsMarkedAndEveryProblemHasARemedy) {
  std::ostringstream out;
  const int status = run_doctor(out);
  std::istringstream lines(out.str());
  int problems = 0;
  bool uhid = false;
  bool uinput = false;
  for (std::string line; std::getline(lines, line);) {
    const std::string mark = line.substr(0, 4);
    EXPECT_TRUE(mark == "ok  " || mark == "--  " || mark == "!!  ") << line;
    if (mark == "!!  ") {
      ++problems;
      EXPECT_NE(line.find_first_of(":;"), std::string::npos) << line;
    }
    uhid = uhid || line.find("/dev/uhid") != std::string::npos;
    uinput = uinput || line.find("/dev/uinput") != std::string::npos;
  }
  EXPECT_TRUE(uhid);
  EXPECT_TRUE(uinput);
  EXPECT_TRUE(status == 0 || (status == 1 && problems > 0));
}

}  // namespace
}  // namespace tagwrench
