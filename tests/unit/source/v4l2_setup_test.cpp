// What can be refused without a camera; the rest is tested in the kernel guest.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "host/source/v4l2_device.h"
#include "host/source/v4l2_source.h"
#include "tests/unit/source/message.h"

namespace tagwrench {
namespace {

std::string refused_camera(const std::string& path) {
  V4l2Options options;
  options.path = path;
  return refusal([&] { V4l2Source source(options); });
}

TEST(V4l2Setup, ANodeThatDoesNotExistIsNoSuchCamera) {
  EXPECT_TRUE(names(refused_camera("/dev/video4711"), {"/dev/video4711", "no such camera"}));
}

TEST(V4l2Setup, WhatIsNotAVideoDeviceIsSaidToBeNone) {
  EXPECT_TRUE(names(refused_camera("/dev/null"), {"/dev/null", "not a video device"}));
}

TEST(V4l2Setup, NoPermissionNamesTheGroup) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may open everything";
  const std::string path = ::testing::TempDir() + "/forbidden";
  std::ofstream(path) << "";
  std::filesystem::permissions(path, std::filesystem::perms::none);
  EXPECT_TRUE(names(refused_camera(path), {"no permission", "video"}));
}

TEST(V4l2Setup, HoldersOfANodeAreNamed) {
  const std::string path = ::testing::TempDir() + "/held_by_child";
  std::ofstream(path) << "x";
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const int fd = ::open(path.c_str(), O_RDONLY);
    const char byte = fd >= 0 ? '1' : '0';
    if (::write(ready[1], &byte, 1) != 1) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  ASSERT_EQ(byte, '1');
  const std::string text = holders_text(path);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_NE(text.find("pid " + std::to_string(child)), std::string::npos) << text;
  EXPECT_NE(text.find("source_test"), std::string::npos) << text;
  EXPECT_EQ(holders_text(path), "");
}

}  // namespace
}  // namespace tagwrench
