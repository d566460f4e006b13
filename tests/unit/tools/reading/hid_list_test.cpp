#include <gtest/gtest.h>

#include "fake_hidapi.h"
#include "host/core/config_error.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {
namespace {

using test::plug;

test::FakeHid spacemouse(const std::string& path, const std::wstring& serial) {
  return {.path = path,
          .vendor = 0x256f,
          .product = 0xc62e,
          .serial = serial,
          .name = L"tagwrench SpaceMouse",
          .usage_page = 1,
          .usage = 8};
}

class HidList : public ::testing::Test {
 protected:
  ~HidList() override { test::unplug_all(); }

  static std::string chosen(const std::string& text) {
    const auto node = HidChoice(text).among(hid_nodes(test::hidraw_class()));
    return node ? node->path : "none";
  }
};

TEST_F(HidList, WrenchesComeFirstAndOtherDevicesNotAtAll) {
  plug(spacemouse("/dev/hidraw0", L"a"));
  plug({.path = "/dev/hidraw1", .vendor = 0x046d, .product = 0xc077, .usage_page = 1, .usage = 2});
  plug({.path = "/dev/hidraw2", .serial = L"b"});
  plug({.path = "/dev/hidraw3", .vendor = 0x1234, .usage_page = 0xff00, .usage = 0x10});  // own id
  plug({.path = "/dev/hidraw4", .vendor = 0x1234, .name = L"other"});
  const std::vector<HidNode> nodes = hid_nodes(test::hidraw_class());
  ASSERT_EQ(nodes.size(), 3u);
  EXPECT_EQ(nodes[0].path, "/dev/hidraw2");
  EXPECT_EQ(nodes[1].path, "/dev/hidraw3");
  EXPECT_EQ(nodes[2].path, "/dev/hidraw0");
  EXPECT_EQ(nodes[2].kind, HidKind::puck);
}

TEST_F(HidList, NamesEachWithKindIdPathSerialAndModel) {
  plug(spacemouse("/dev/hidraw0", L""));
  plug({.path = "/dev/hidraw12"});
  EXPECT_EQ(list_text(hid_nodes(test::hidraw_class())),
            "wrench  1209:7a6e  /dev/hidraw12  tagwrench-0       tagwrench wrench sensor\n"
            "6-dof   256f:c62e  /dev/hidraw0   -                 tagwrench SpaceMouse, as "
            "SpaceMouse Wireless (cable) (combined layout)\n");
}

TEST_F(HidList, ADeviceIsChosenBySerialPathOrId) {
  plug({.path = "/dev/hidraw0", .serial = L"left"});
  plug({.path = "/dev/hidraw1", .serial = L"right"});
  plug(spacemouse("/dev/hidraw2", L"left"));
  EXPECT_EQ(chosen("right"), "/dev/hidraw1");
  EXPECT_EQ(chosen("left"), "/dev/hidraw0") << "the wrench sensor goes before the puck";
  EXPECT_EQ(chosen("256F:c62e"), "/dev/hidraw2");
  EXPECT_EQ(chosen("/dev/hidraw2"), "/dev/hidraw2");
  EXPECT_EQ(chosen("middle"), "none");
  EXPECT_EQ(chosen("/dev/hidraw9"), "none");
  EXPECT_EQ(chosen("256f:c62f"), "none");
}

TEST_F(HidList, NothingIsGuessedBetweenTwoOfAKind) {
  plug({.path = "/dev/hidraw0", .serial = L"left"});
  plug(spacemouse("/dev/hidraw2", L"left"));
  EXPECT_EQ(chosen(""), "/dev/hidraw0");
  plug({.path = "/dev/hidraw1", .serial = L"right"});
  for (const char* text : {"", "1209:7a6e"}) {
    try {
      chosen(text);
      FAIL() << "one of two was chosen";
    } catch (const ConfigError& error) {
      const std::string said = error.what();
      EXPECT_NE(said.find("left (/dev/hidraw0)"), std::string::npos) << said;
      EXPECT_NE(said.find("right (/dev/hidraw1)"), std::string::npos) << said;
    }
  }
}

TEST_F(HidList, WordsSayWhatWasAskedFor) {
  EXPECT_EQ(HidChoice("").words(), "wrench sensor or 6-DOF device");
  EXPECT_EQ(HidChoice("bench").words(), "wrench sensor or 6-DOF device with the serial bench");
  EXPECT_EQ(HidChoice("1209:7a6e").words(), "wrench sensor or 6-DOF device with the id 1209:7a6e");
  EXPECT_EQ(HidChoice("1209-7a6e").words(),
            "wrench sensor or 6-DOF device with the serial 1209-7a6e");
}

TEST_F(HidList, TheSameDeviceIsKnownAgainOnAnotherNode) {
  const HidNode before{HidKind::wrench, 1, 2, "/dev/hidraw0", "left", ""};
  EXPECT_TRUE((HidNode{HidKind::wrench, 1, 2, "/dev/hidraw5", "left", ""}).is_again(before));
  EXPECT_FALSE((HidNode{HidKind::wrench, 1, 2, "/dev/hidraw0", "right", ""}).is_again(before));
}

}  // namespace
}  // namespace tagwrench
