#include <gtest/gtest.h>

#include <random>

#include "host/tools/reading/reader.h"
#include "tests/cli/bridge.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;
using Usages = std::vector<HidUsage>;

// Usage Page (Generic Desktop), Usage (Multi-axis Controller), Collection (Application), ...
const std::string kPuck("\x05\x01\x09\x08\xa1\x01\xc0", 7);

/// A folder as /sys is: links in class/hidraw to devices elsewhere.
class HidSysfs : public ::testing::Test {
 protected:
  HidSysfs() { fs::create_directories(hidraw_class_); }

  /// `at`: below devices/.
  fs::path add(const std::string& node, const std::string& at, const std::string& uevent,
               const std::string& descriptor = kPuck) {
    const fs::path device = folder_ / "devices" / at;
    fs::create_directories(device);
    fs::create_directories(hidraw_class_ / node);
    fs::create_directory_symlink(device, hidraw_class_ / node / "device");
    test::write_file(device / "uevent", uevent);
    test::write_file(device / "report_descriptor", descriptor);
    return device;
  }
  std::vector<HidNode> list() const { return hid_nodes(hidraw_class_); }

  test::TemporaryFolder folder_;
  fs::path hidraw_class_ = folder_ / "class/hidraw";
};

TEST_F(HidSysfs, AVirtualDeviceHasTheKernelsNameAndSerial) {
  add("hidraw3", "virtual/misc/uhid/0003:1209:7A6E.0001",
      "DRIVER=hid-generic\nHID_ID=0003:00001209:00007A6E\nHID_NAME=tagwrench wrench sensor\n"
      "HID_PHYS=x\nHID_UNIQ=bench=2\nMODALIAS=hid:b0003\n");
  const auto devices = list();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].vendor, 0x1209);
  EXPECT_EQ(devices[0].product, 0x7a6e);
  EXPECT_EQ(devices[0].path, "/dev/hidraw3");
  EXPECT_EQ(devices[0].name, "tagwrench wrench sensor");
  EXPECT_EQ(devices[0].serial, "bench=2");
  EXPECT_EQ(devices[0].kind, HidKind::puck);
}

TEST_F(HidSysfs, ADeviceOnUsbHasItsProductsNameWithoutTheManufacturer) {
  add("hidraw0", "usb1/1-1/1-1:1.0/0003:256F:C635.0002",
      "HID_ID=0003:0000256F:0000C635\nHID_NAME=3Dconnexion SpaceMouse Compact\nHID_UNIQ=\n");
  test::write_file(folder_ / "devices/usb1/1-1/product", "SpaceMouse Compact\n");
  const auto devices = list();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].name, "SpaceMouse Compact");
  EXPECT_EQ(devices[0].serial, "");
  test::write_file(folder_ / "devices/usb1/1-1/product", "without an end of line");
  EXPECT_EQ(list().at(0).name, "without an end of line");
}

TEST_F(HidSysfs, ADeviceMayHaveNeitherNameNorSerial) {
  add("hidraw0", "a", "HID_ID=0003:00000001:00000002");
  const auto devices = list();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].product, 2);
  EXPECT_EQ(devices[0].name, "");
  EXPECT_EQ(devices[0].serial, "");
}

TEST_F(HidSysfs, WhatIsHalfThereIsLeftOut) {
  const std::string uevent = "HID_ID=0003:00000001:00000002\n";
  fs::remove(add("hidraw0", "a", uevent) / "uevent");
  fs::remove(add("hidraw1", "b", uevent) / "report_descriptor");
  fs::remove_all(add("hidraw2", "c", uevent));  // the link leads nowhere
  fs::create_directories(hidraw_class_ / "hidraw3");
  add("hidraw4", "d", "");
  add("hidraw5", "e", "HID_NAME=no id\n");
  add("hidraw6", "f", "HID_ID=0003:00000001\n");
  add("hidraw7", "g", "HID_ID=0003:00010001:00000002\n");
  add("hidraw8", "h", "HID_ID=0003:00000001:00000002:5\n");
  add("hidraw9", "i", "HID_ID=0003:0000000x:00000002\n");
  add("hidraw", "j", uevent);
  add("hidraw1x", "k", uevent);
  add("js0", "l", uevent);
  EXPECT_TRUE(list().empty());
  add("hidraw12", "y", uevent);
  add("hidraw7b", "m", uevent);
  add("hidraw10", "z", uevent);
  const auto devices = list();
  ASSERT_EQ(devices.size(), 2u);
  EXPECT_EQ(devices[0].path, "/dev/hidraw10");
  EXPECT_EQ(devices[1].path, "/dev/hidraw12");
}

TEST_F(HidSysfs, AMachineWithoutHidDevicesHasNone) {
  EXPECT_TRUE(hid_nodes(folder_ / "no such folder").empty());
}

TEST_F(HidSysfs, TextsAreFitForATerminal) {
  add("hidraw0", "a",
      "HID_ID=0003:00000001:00000002\nHID_NAME=K\xc3\xa4se \x1b[31m \xff\xe2\x82 \xc2\x9b\n"
      "HID_UNIQ=\xf0\x9f\x98\x80\x07 \xe0\x80\x80 \xf0\x80\x80\x9b\n");
  const auto devices = list();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].name, "K\xc3\xa4se ?[31m ??? ?");
  EXPECT_EQ(devices[0].serial, "\xf0\x9f\x98\x80? ??? ????");
}

TEST(TopLevelUsages, EveryCollectionOnTheOutsideCounts) {
  EXPECT_EQ(top_level_usages(Bytes{
                0x05, 0x01, 0x09, 0x08, 0xa1, 0x01,  // Generic Desktop, Multi-axis, Application
                0x09, 0x30, 0x09, 0x31, 0x81, 0x02,  // X, Y, Input
                0x09, 0x01, 0xa1, 0x00, 0xc0,        // a collection within: not on the outside
                0xc0,                                // End
                0x06, 0x00, 0xff, 0x09, 0x10, 0xa1, 0x01, 0xc0}),  // ff00, 10
            (Usages{{0x01, 0x08}, {0xff00, 0x10}}));
}

TEST(TopLevelUsages, ThePageIsThatOfTheCollectionOrTheUsagesOwn) {
  EXPECT_EQ(top_level_usages(Bytes{0x09, 0x08, 0x05, 0x01, 0xa1, 0x01}), (Usages{{1, 8}}))
      << "the page may be told after the usage (HID 1.11, 6.2.2.8)";
  EXPECT_EQ(top_level_usages(Bytes{0x05, 0x01, 0x0b, 0x10, 0x00, 0x00, 0xff, 0xa1, 0x01}),
            (Usages{{0xff00, 0x10}}));
  EXPECT_EQ(top_level_usages(Bytes{0x05, 0x01, 0x09, 0x08, 0x09, 0x04, 0xa1, 0x01}),
            (Usages{{1, 8}}));
}

TEST(TopLevelUsages, LongItemsArePassedOver) {
  EXPECT_EQ(
      top_level_usages(Bytes{0x05, 0x01, 0xfe, 0x02, 0x77, 0x09, 0x04, 0x09, 0x08, 0xa1, 0x01}),
      (Usages{{1, 8}}));
}

TEST(TopLevelUsages, ADescriptorThatEndsEarlyGivesWhatItGaveSoFar) {
  const Bytes whole{0x05, 0x01, 0x09, 0x08, 0xa1, 0x01, 0xc0, 0xfe, 0xff,
                    0x00, 0x06, 0x00, 0xff, 0x09, 0x10, 0xa1, 0x01};
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    // Copied, so that a read beyond its end is one beyond the memory's.
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(top_level_usages(cut), size < 6 ? Usages{} : (Usages{{1, 8}})) << size;
  }
  EXPECT_TRUE(top_level_usages(Bytes{0xc0, 0xc0, 0xa1, 0x01, 0xfe}).empty());
}

TEST(TopLevelUsages, AnyBytesMayCome) {
  std::mt19937 random(3);
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes(random() % 64);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    EXPECT_LE(top_level_usages(bytes).size(), bytes.size());
  }
}

}  // namespace
}  // namespace tagwrench
