// Names of recordings, and programs that read our devices.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/web/bridge/camera_settings.h"
#include "host/web/bridge/job_command.h"
#include "host/web/bridge/recording_folder.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

class BridgeFolder : public testing::Test {
 protected:
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
};

TEST(RecordingNames, AreLettersDigitsAndThreeSigns) {
  for (const char* good : {"push", "push-2_b.twr", "A", "2026"})
    EXPECT_TRUE(is_recording_name(good));
  for (const char* bad : {"", ".hidden", "..", "a/b", "../x", "-rf", "a b", "a\nb", "\xc3\xa4"})
    EXPECT_FALSE(is_recording_name(bad)) << bad;
  EXPECT_FALSE(is_recording_name(std::string(65, 'a')));
}

TEST_F(BridgeFolder, ANewRecordingReplacesNothing) {
  const RecordingFolder recordings(folder_ / "deep/er");
  EXPECT_EQ(recordings.list(), nlohmann::json::array());
  const fs::path file = recordings.new_file("push");
  EXPECT_EQ(file, folder_ / "deep/er/push.twr");
  std::ofstream(file) << "12345";
  EXPECT_THROW(recordings.new_file("push"), RequestRefused);
  EXPECT_THROW(recordings.new_file("push.twr"), RequestRefused);
  EXPECT_THROW(recordings.new_file("../push"), RequestRefused);
  fs::create_symlink("/etc/passwd", folder_ / "deep/er/linked.twr");
  const nlohmann::json list = recordings.list();
  ASSERT_EQ(list.size(), 1U) << list;
  EXPECT_EQ(list[0]["name"], "push.twr");
  EXPECT_EQ(list[0]["bytes"], 5);
}

TEST_F(BridgeFolder, TheLongestNameIsListedToo) {
  const RecordingFolder recordings(folder_);
  const std::string longest(RecordingFolder::kMaxName, 'a');
  std::ofstream(recordings.new_file(longest)) << "1";
  std::ofstream(folder_ / (longest + "a.twr")) << "of somebody else";
  const nlohmann::json list = recordings.list();
  ASSERT_EQ(list.size(), 1U) << list;
  EXPECT_EQ(list[0]["name"], longest + ".twr");
}

TEST_F(BridgeFolder, ReadersOfOurDevicesAreFoundByTheirOpenFiles) {
  const KernelFolders kernel{folder_ / "proc", folder_ / "hidraw", folder_ / "input"};
  write("hidraw/hidraw3/device/uevent", "DRIVER=x\nHID_UNIQ=tagwrench-left\n");
  write("hidraw/hidraw4/device/uevent", "HID_UNIQ=tagwrench-left2\n");
  write("input/event7/device/name", "tagwrench joystick\n");
  write("input/event8/device/name", "keyboard\n");
  const auto open = [&](const char* process, const char* program, const char* node) {
    write(fs::path("proc") / process / "comm", std::string(program) + "\n");
    const fs::path fds = folder_ / "proc" / process / "fd";
    fs::create_directories(fds);
    fs::create_symlink(node, fds / ("5" + std::string(1, node[7])));
  };
  open("11", "spacenavd", "/dev/hidraw3");
  open("12", "other", "/dev/hidraw4");
  open("13", "game", "/dev/input/event7");
  open("14", "typing", "/dev/input/event8");
  open("15", "tw-watchdog", "/dev/hidraw3");
  open(std::to_string(::getpid()).c_str(), "us", "/dev/hidraw3");
  const std::vector<DeviceReader> expected = {{"game", "evdev"}, {"spacenavd", "hidraw"}};
  EXPECT_EQ(device_readers("tagwrench-left", kernel), expected);
}

TEST(CameraSettingValues, AreTheNearestThatTheCameraHas) {
  const CameraSetting exposure{1, "exposure", 150, 3, 2047, 4, true};
  EXPECT_EQ(nearest(exposure, -5), 3);
  EXPECT_EQ(nearest(exposure, 8), 7);
  EXPECT_EQ(nearest(exposure, 10), 11);
  EXPECT_EQ(nearest(exposure, std::int64_t{1} << 40), 2047);
  const CameraSetting wide{2, "wide", 0, -2147483647, 2147483647, 1, true};
  EXPECT_EQ(nearest(wide, std::int64_t{1} << 40), 2147483647);
}

}  // namespace
}  // namespace tagwrench
