#include <gtest/gtest.h>

#include "host/motion/control_socket.h"
#include "host/tools/doctor/doctor.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

TEST(DoctorAccess, NamesTheFirstThingThatIsInTheWay) {
  NodeAccess access;
  EXPECT_NE(access_advice(access).find("install the udev rule"), std::string::npos);
  access.rule_installed = true;
  EXPECT_NE(access_advice(access).find("udevadm control --reload"), std::string::npos);
  access.rule_applied = true;
  EXPECT_NE(access_advice(access).find("sudo usermod -aG tagwrench"), std::string::npos);
  access.member = true;
  EXPECT_NE(access_advice(access).find("log out and in"), std::string::npos);
  EXPECT_EQ(access_advice(access).find("usermod"), std::string::npos);
}

TEST(DoctorAccess, ANodeOfRootAloneHasNoRuleApplied) {
  const TemporaryFolder folder;
  folder.write("uhid", "");
  fs::permissions(folder / "uhid", fs::perms::owner_all);
  EXPECT_FALSE(look_at_access(folder / "uhid").rule_applied);
  EXPECT_FALSE(look_at_access(folder / "none").rule_applied);
}

TEST(DoctorAccess, OurDevicesAreKnownByTheNameOfTheirHidDevice) {
  const TemporaryFolder folder;
  // The layout of /sys/class/hidraw/hidrawN/device/uevent.
  folder.write("hidraw0/device/uevent",
               "DRIVER=hid-generic\nHID_ID=0003:0000256F:0000C62E\n"
               "HID_NAME=tagwrench 3Dconnexion SpaceMouse\nHID_UNIQ=tagwrench-sensor\n");
  folder.write("hidraw1/device/uevent",
               "HID_ID=0003:0000256F:0000C635\nHID_NAME=3Dconnexion SpaceMouse Compact\n"
               "HID_UNIQ=tagwrench\n");
  folder.write("hidraw12/device/uevent", "HID_NAME=tagwrench force-torque sensor\n");
  folder.write("hidraw3/nothing", "");
  EXPECT_EQ(our_hidraw(folder / ""), (std::vector<std::string>{"hidraw0", "hidraw12"}));
  EXPECT_TRUE(our_hidraw(folder / "none").empty());
}

TEST(DoctorBridges, ASensorRunsWhereItsSocketIsListenedTo) {
  const TemporaryFolder folder;
  const ControlSocket left((folder / "left.control").string());
  folder.write("right.control", "a left-over");
  folder.write("spnav.sock", "");
  EXPECT_EQ(running_sensors(folder / ""), std::vector<std::string>{"left"});
  EXPECT_TRUE(running_sensors(folder / "none").empty());
}

TEST(DoctorBridges, AServiceStartsAtLoginWhereATargetWantsIt) {
  const TemporaryFolder folder;
  EXPECT_FALSE(starts_at_login(folder / ""));
  folder.write("systemd/user/default.target.wants/other.service", "");
  EXPECT_FALSE(starts_at_login(folder / ""));
  fs::create_symlink("/usr/lib/systemd/user/tagwrench.service",
                     folder / "systemd/user/default.target.wants/tagwrench.service");
  EXPECT_TRUE(starts_at_login(folder / "")) << "whether or not the link leads anywhere";
}

}  // namespace
}  // namespace tagwrench
