#include <gtest/gtest.h>
#include <poll.h>

#include "host/core/config_error.h"
#include "host/motion/profile_config.h"
#include "host/sensor/sensor_config.h"
#include "tests/unit/motion/profile_folder.h"

namespace tagwrench {
namespace {

class ProfileFilesTest : public test::ProfileFolder {
 protected:
  static std::vector<std::string> names(const ProfileFiles& files) {
    std::vector<std::string> all;
    for (const Profile& profile : files.profiles()) all.push_back(profile.name);
    return all;
  }
  /// The one change that saving made.
  static ProfileFiles::Change change(ProfileFiles& files) {
    pollfd waiting{files.fd(), POLLIN, 0};
    EXPECT_EQ(::poll(&waiting, 1, 10'000), 1) << "nobody noticed";
    const std::vector<ProfileFiles::Change> changes = files.reread();
    EXPECT_EQ(changes.size(), 1U);
    return changes.empty() ? ProfileFiles::Change{} : changes.front();
  }
};

TEST_F(ProfileFilesTest, AreReadyMadeOnesFilesAndFoldersInTheOrderGiven) {
  write("b.yaml", "name: second\n");
  write("a.yaml", "translation: 0.5\n");
  write("notes.txt", "no profile");
  EXPECT_EQ(names(ProfileFiles({"game", path("")}, default_profile(sensor_))),
            (std::vector<std::string>{"game", "a", "second"}));
  EXPECT_EQ(ProfileFiles({}, default_profile(sensor_)).profiles().size(), 1U) << "the sensor's own";
  EXPECT_EQ(ProfileFiles({"cad"}, default_profile(sensor_)).fd(), -1) << "nothing to watch";
}

TEST_F(ProfileFilesTest, WhatCannotBeIsRefusedAtTheStart) {
  write("a.yaml", "name: cad\n");
  write("bad.yaml", "name: bad\ntranslatoin: 1\n");
  std::filesystem::create_directory(path("empty"));
  write("long.yaml", "name: long\n" + std::string(70'000, '#'));
  for (const std::vector<std::string>& chosen : {std::vector<std::string>{"cad", path("a.yaml")},
                                                 {path("bad.yaml")},
                                                 {path("empty")},
                                                 {path("none.yaml")},
                                                 {path("long.yaml")}})
    EXPECT_THROW(ProfileFiles(chosen, default_profile(sensor_)), ConfigError) << chosen.back();
}

TEST_F(ProfileFilesTest, ASavedFileIsReadAgain) {
  write("a.yaml", "translation: 0.5\n");
  ProfileFiles files({"game", path("a.yaml")}, default_profile(sensor_));
  write("a.yaml", "translation: 0.25\n");
  const ProfileFiles::Change saved = change(files);
  EXPECT_EQ(saved.profile, 1U);
  EXPECT_EQ(files.profiles()[1].shaping.translation, 0.25);

  write("new.tmp", "translation: 2\n");  // as most editors save
  std::filesystem::rename(path("new.tmp"), path("a.yaml"));
  EXPECT_EQ(change(files).profile, 1U);
  EXPECT_EQ(files.profiles()[1].shaping.translation, 2);
}

TEST_F(ProfileFilesTest, AMistakeLeavesTheEarlierOneAndSaysTheLine) {
  write("a.yaml", "translation: 0.5\n");
  ProfileFiles files({path("a.yaml")}, default_profile(sensor_));
  write("a.yaml", "rotation: 1\ntranslation: half\n");
  const ProfileFiles::Change saved = change(files);
  EXPECT_FALSE(saved.profile);
  EXPECT_NE(saved.line.find("a.yaml:2"), std::string::npos) << saved.line;
  EXPECT_EQ(files.profiles()[0].shaping.translation, 0.5);
  write("a.yaml", "translation: 2\n" + std::string(70'000, '#'));
  EXPECT_FALSE(change(files).profile);
  EXPECT_EQ(files.profiles()[0].shaping.translation, 0.5) << "half a file is none";
  std::filesystem::remove(path("a.yaml"));
  EXPECT_TRUE(files.reread().empty());
}

}  // namespace
}  // namespace tagwrench
