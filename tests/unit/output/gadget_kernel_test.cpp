// Controllers and nodes, as a sysfs and a /dev in a folder show them.
#include <gtest/gtest.h>
#include <sys/sysmacros.h>

#include <cerrno>
#include <filesystem>

#include "gadget_rig.h"
#include "host/core/config_error.h"
#include "host/output/gadget_tree.h"

namespace tagwrench {
namespace {

using test::put_text;
using test::TemporaryTree;

class Controllers : public ::testing::Test {
 protected:
  void controller(const std::string& name, const std::string& function = "") {
    const std::string at = folder_ / ("sys/class/udc/" + name);
    put_text(at + "/state", "configured\n");
    put_text(at + "/current_speed", "high-speed\n");
    put_text(at + "/function", function);
  }
  std::string refusal(const std::string& wanted,
                      const std::vector<GadgetFound>& gadgets = {}) const {
    try {
      choose_controller(controllers(files_, places_, gadgets), wanted, "tagwrench-sensor");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "none";
  }
  std::string chosen(const std::vector<GadgetFound>& gadgets = {}) const {
    return choose_controller(controllers(files_, places_, gadgets), "", "tagwrench-sensor").name;
  }

  TemporaryTree folder_;
  GadgetFiles files_;
  KernelPlaces places_{folder_ / "config", folder_ / "sys", folder_ / "dev"};
};

GadgetFound bound(const std::string& folder, const std::string& udc) {
  GadgetFound gadget;
  gadget.folder = folder;
  gadget.udc = udc;
  return gadget;
}

TEST_F(Controllers, OfWhichThereIsNoneNameTheBoardsThatHaveOne) {
  EXPECT_NE(refusal("").find("Raspberry Pi Zero"), std::string::npos);
  EXPECT_NE(refusal("").find("dtoverlay=dwc2"), std::string::npos);
  EXPECT_EQ(refusal("").find('\n'), std::string::npos);
}

TEST_F(Controllers, OfOthersAreLeftToThemByName) {
  controller("a.usb");
  EXPECT_NE(refusal("", {bound("g1", "a.usb")}).find("a.usb belongs to g1"), std::string::npos);
  EXPECT_NE(refusal("", {bound("tagwrench-left", "a.usb")}).find("gadget down --name left"),
            std::string::npos);
  controller("a.usb", "g_ether\n");  // a driver of the time before configfs
  EXPECT_NE(refusal("").find("belongs to g_ether"), std::string::npos);
  EXPECT_NE(refusal("b.usb").find("no such USB device controller; there is a.usb"),
            std::string::npos);
}

TEST_F(Controllers, FreeOrOurOwnAreTaken) {
  controller("a.usb");
  controller("b.usb");
  EXPECT_EQ(chosen(), "a.usb");
  EXPECT_EQ(chosen({bound("g1", "a.usb")}), "b.usb");
  EXPECT_EQ(chosen({bound("tagwrench-sensor", "a.usb")}), "a.usb");
}

TEST(DeviceNumber, IsTwoNumbersThatTheKernelCanHave) {
  EXPECT_EQ(parse_device_number("236:5"), makedev(236, 5));
  for (const char* bad :
       {"", ":", "236", "236:", ":5", "236:5 ", "-1:5", "236:99999999", "5000:1", "236:5:6", "a:b"})
    EXPECT_FALSE(parse_device_number(bad)) << bad;
}

TEST_F(Controllers, NodeIsFoundByNumberAndOnlyAHidgIsOne) {
  const std::string function = folder_ / "config/usb_gadget/tagwrench-sensor/functions/hid.wrench";
  put_text(function + "/dev", "236:5\n");
  EXPECT_FALSE(gadget_node(files_, places_, function));
  std::filesystem::create_directories(folder_ / "sys/dev/char");
  const std::string number = folder_ / "sys/dev/char/236:5";
  std::filesystem::create_symlink("../../devices/virtual/hidg/hidg7", number);
  EXPECT_EQ(gadget_node(files_, places_, function), "hidg7");
  for (const char* other :
       {"../../devices/sda", "../../hidg", "../../hidgx", "../../hidg1/..", "/"}) {
    std::filesystem::remove(number);
    std::filesystem::create_symlink(other, number);
    EXPECT_FALSE(gadget_node(files_, places_, function)) << other;
  }
}

TEST_F(Controllers, NodeThatIsNoDeviceOfThatNumberIsNotOpened) {
  const std::string function = folder_ / "config/usb_gadget/tagwrench-sensor/functions/hid.wrench";
  put_text(function + "/dev", "236:5\n");
  std::filesystem::create_directories(folder_ / "sys/dev/char");
  std::filesystem::create_symlink("../../devices/virtual/hidg/hidg7",
                                  folder_ / "sys/dev/char/236:5");
  EXPECT_EQ(open_gadget_node(files_, places_, function).error, ENOENT);
  put_text(folder_ / "dev/hidg7", "a file");
  const OpenedNode file = open_gadget_node(files_, places_, function);
  EXPECT_FALSE(file.fd);
  EXPECT_EQ(file.error, ENXIO);
}

}  // namespace
}  // namespace tagwrench
