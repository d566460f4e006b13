#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "fake_hidapi.h"
#include "golden.h"
#include "host/tools/reading/hid_text.h"
#include "host/tools/reading/tagwrench_hid.h"
#include "tests/cli/bridge.h"

namespace tagwrench {
namespace {

using test::FakeHid;
using test::numbered_report;
using test::plug;

struct CloseDevice {
  void operator()(tagwrench_device* device) const { tagwrench_close(device); }
};
using OwnedDevice = std::unique_ptr<tagwrench_device, CloseDevice>;

class ClientDevice : public ::testing::Test {
 protected:
  ~ClientDevice() override { test::unplug_all(); }

  OwnedDevice open(const char* serial = nullptr) {
    return OwnedDevice(tagwrench_open(serial, why_.data(), why_.size()));
  }
  std::string why() const { return why_.data(); }

  std::array<char, TAGWRENCH_TEXT_SIZE> why_{};
  tagwrench_sample sample_{};
};

TEST_F(ClientDevice, OnlyWrenchSensorsAreListed) {
  plug({.path = "/dev/hidraw0"});
  plug({.path = "/dev/hidraw1", .vendor = 0x256f, .product = 0xc62e, .usage_page = 1, .usage = 8});
  plug({.path = "/dev/hidraw2", .usage_page = 1, .usage = 8});
  plug({.path = "/dev/hidraw3", .serial = L"bench", .usage_page = 0, .usage = 0});  // as by libusb
  std::array<tagwrench_device_info, 4> infos{};
  ASSERT_EQ(tagwrench_enumerate(infos.data(), infos.size()), 2u);
  EXPECT_STREQ(infos[0].path, "/dev/hidraw0");
  EXPECT_STREQ(infos[0].serial, "tagwrench-0");
  EXPECT_STREQ(infos[0].name, "tagwrench wrench sensor");
  EXPECT_STREQ(infos[1].serial, "bench");
}

TEST_F(ClientDevice, ADeviceThatGoesWhileItIsListedIsNoDevice) {
  plug({.path = "/dev/hidraw0", .serial = L"left", .half_gone = true});
  plug({.path = "/dev/hidraw1", .serial = L"right"});
  EXPECT_EQ(tagwrench_enumerate(nullptr, 0), 1u);
  EXPECT_EQ(open("left"), nullptr);
  EXPECT_STREQ(tagwrench_info(open().get())->serial, "right");
  const OwnedDevice by_path(tagwrench_open_path("/dev/hidraw1", why_.data(), why_.size()));
  EXPECT_STREQ(tagwrench_info(by_path.get())->serial, "right");
}

TEST_F(ClientDevice, MoreDevicesThanRoomAreCountedAndNotWritten) {
  for (const char* path : {"/dev/hidraw0", "/dev/hidraw1", "/dev/hidraw2"}) plug({.path = path});
  std::array<tagwrench_device_info, 2> infos{};
  EXPECT_EQ(tagwrench_enumerate(infos.data(), 1), 3u);
  EXPECT_STREQ(infos[1].path, "");
  EXPECT_EQ(tagwrench_enumerate(nullptr, 0), 3u);
}

TEST_F(ClientDevice, TheSerialChooses) {
  plug({.path = "/dev/hidraw0", .serial = L"left"});
  plug({.path = "/dev/hidraw1", .serial = L"right"});
  EXPECT_STREQ(tagwrench_info(open("right").get())->path, "/dev/hidraw1");
  EXPECT_STREQ(tagwrench_info(open().get())->path, "/dev/hidraw0");
  EXPECT_FALSE(open("middle"));
  EXPECT_EQ(why(), "no wrench sensor has the serial 'middle'; there is: left, right");
}

TEST_F(ClientDevice, WithoutAnyItSaysSo) {
  EXPECT_FALSE(open());
  EXPECT_EQ(why(),
            "no wrench sensor (HID device 1209:7a6e) is here; start the bridge with an output "
            "`wrench`");
}

TEST_F(ClientDevice, OneThatDoesNotOpenIsNamedWithTheCause) {
  plug({.path = "/nowhere/hidraw7", .opens = false});
  EXPECT_FALSE(open());
  EXPECT_EQ(why(), "/nowhere/hidraw7: not there; `tagwrench read --list` says what is");
}

TEST_F(ClientDevice, APathOpensADeviceOfAnyId) {
  plug({.path = "/dev/hidraw5", .vendor = 0x1234, .product = 1, .serial = L"own"});
  const OwnedDevice device(tagwrench_open_path("/dev/hidraw5", why_.data(), why_.size()));
  ASSERT_TRUE(device) << why();
  EXPECT_STREQ(tagwrench_info(device.get())->serial, "own");
}

TEST_F(ClientDevice, SamplesComeInOrderAndThenNone) {
  plug({.path = "/dev/hidraw0", .reports = {numbered_report(1), numbered_report(2)}});
  const OwnedDevice device = open();
  ASSERT_EQ(tagwrench_read(device.get(), &sample_, 100), 1);
  EXPECT_EQ(sample_.sequence, 1u);
  ASSERT_EQ(tagwrench_read(device.get(), &sample_, 100), 1);
  EXPECT_EQ(sample_.sequence, 2u);
  EXPECT_EQ(tagwrench_read(device.get(), &sample_, 0), 0);
}

TEST_F(ClientDevice, StrangeReportsAreSkippedAndCounted) {
  std::vector<std::uint8_t> longer = numbered_report(3);
  longer.push_back(0);
  std::vector<std::uint8_t> shorter = numbered_report(4);
  shorter.pop_back();
  plug({.path = "/dev/hidraw0", .reports = {{1, 2, 3}, longer, shorter, numbered_report(5)}});
  const OwnedDevice device = open();
  ASSERT_EQ(tagwrench_read(device.get(), &sample_, 100), 1);
  EXPECT_EQ(sample_.sequence, 5u);
  EXPECT_EQ(tagwrench_strangers(device.get()), 3u);
}

TEST_F(ClientDevice, TheNewestIsTakenAndTheOlderOnesCounted) {
  plug({.path = "/dev/hidraw0",
        .reports = {numbered_report(1), numbered_report(2), {9}, numbered_report(3)}});
  const OwnedDevice device = open();
  std::uint32_t skipped = 99;
  ASSERT_EQ(tagwrench_read_newest(device.get(), &sample_, 100, &skipped), 1);
  EXPECT_EQ(sample_.sequence, 3u);
  EXPECT_EQ(skipped, 2u);
  EXPECT_EQ(tagwrench_read_newest(device.get(), &sample_, 0, &skipped), 0);
  EXPECT_EQ(skipped, 0u);
}

TEST_F(ClientDevice, ASourceFasterThanItsReaderDoesNotHoldItForEver) {
  const auto hid = plug({.path = "/dev/hidraw0", .reports = {numbered_report(1)}});
  hid->idle = [&hid] { hid->reports.push_back(numbered_report(1)); };
  EXPECT_EQ(tagwrench_read_newest(open().get(), &sample_, 100, nullptr), 1);
  hid->idle = nullptr;
}

TEST_F(ClientDevice, WhatCameBeforeTheEndIsReadBeforeTheEnd) {
  plug({.path = "/dev/hidraw0", .gone = true, .reports = {numbered_report(1), numbered_report(2)}});
  const OwnedDevice device = open();
  EXPECT_EQ(tagwrench_read_newest(device.get(), &sample_, -1, nullptr), 1);
  EXPECT_EQ(sample_.sequence, 2u);
  const int end = tagwrench_read(device.get(), &sample_, -1);
  EXPECT_EQ(end, TAGWRENCH_ERROR_GONE);
  EXPECT_STREQ(tagwrench_error_text(end), "the device is gone: unplugged, or the bridge has ended");
}

TEST_F(ClientDevice, ASignalEndsTheWaitAndIsNotTakenForTheEndOfTheDevice) {
  plug({.path = "/dev/hidraw0", .gone = true, .interrupted = true});
  const OwnedDevice device = open();
  EXPECT_EQ(tagwrench_read(device.get(), &sample_, -1), 0);
  EXPECT_EQ(tagwrench_read(device.get(), &sample_, -1), TAGWRENCH_ERROR_GONE);
}

TEST(ClientText, WithoutPermissionTheRuleIsNamedThatWouldGiveIt) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may open everything";
  test::TemporaryFolder folder;
  const std::string node = folder / "hidraw0";
  test::write_file(node, "");
  std::filesystem::permissions(node, std::filesystem::perms::none);
  std::array<char, TAGWRENCH_TEXT_SIZE> why{};
  tagwrench_why_not_open(node.c_str(), 0x1209, 0x7a6e, why.data(), why.size());
  EXPECT_NE(std::string(why.data()).find("70-tagwrench.rules"), std::string::npos) << why.data();
  tagwrench_why_not_open(node.c_str(), 0x046d, 0xc626, why.data(), why.size());
  EXPECT_NE(std::string(why.data()).find("*:046D:C626.*"), std::string::npos) << why.data();
}

TEST(ClientText, WhatADeviceSaysIsUtf8WithoutControlCharacters) {
  std::array<char, 32> out{};
  tagwrench_utf8(L"a\x1b[2J\u00b5\u20ac\U0001f527\x7f", out.data(), out.size());
  EXPECT_STREQ(out.data(), "a?[2J\u00b5\u20ac\U0001f527?");
  tagwrench_utf8(nullptr, out.data(), out.size());
  EXPECT_STREQ(out.data(), "");
}

TEST(ClientText, WhatIsTooLongIsCutAtAWholeCharacter) {
  std::array<char, 6> out{};
  tagwrench_utf8(L"abc\u20ac", out.data(), out.size());  // three bytes, and room for two
  EXPECT_STREQ(out.data(), "abc");
}

}  // namespace
}  // namespace tagwrench
