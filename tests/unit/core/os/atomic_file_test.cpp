#include "host/core/os/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "host/core/config_error.h"
#include "host/core/os/text_file.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public testing::Test {
 protected:
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
};

TEST_F(AtomicFile, IsReplacedAsAWholeKeepingItsMode) {
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, "old");
  ::chmod(file.c_str(), 0640);
  write_atomically(file, "new");
  EXPECT_EQ(read_text(file), "new");
  struct stat now {};
  ::stat(file.c_str(), &now);
  EXPECT_EQ(now.st_mode & 07777, 0640u);
  EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFile, BehindASymbolicLinkIsReplacedThere) {
  fs::create_directory(folder_ / "real");
  write_atomically(folder_ / "real" / "a.yaml", "old");
  fs::create_symlink("real/a.yaml", folder_ / "sensor.yaml");
  write_atomically(folder_ / "sensor.yaml", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "sensor.yaml"));
  EXPECT_EQ(read_text(folder_ / "real" / "a.yaml"), "new");
}

TEST_F(AtomicFile, APipeOrADeviceIsNotReplaced) {
  const fs::path pipe = folder_ / "pipe";  // as root, /dev/null would be gone
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(write_atomically(pipe, "new"), ConfigError);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(files(), 1U);
}

constexpr uid_t kAnother = 1501;

TEST_F(AtomicFile, ThatAnotherUserHasPutThereGivesTheNewOneNeitherItsModeNorItsOwner) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a file of another user";
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, "his");
  ASSERT_EQ(::chown(file.c_str(), kAnother, kAnother), 0);
  ::chmod(file.c_str(), 06777);
  write_atomically(file, "new");
  struct stat now {};
  ::stat(file.c_str(), &now);
  EXPECT_EQ(now.st_uid, ::geteuid());
  EXPECT_EQ(now.st_mode & 07022, 0U) << "no set-id bits, and nobody else writes to it";
}

TEST_F(AtomicFile, OfAUserInHisOwnFolderStaysHisWhenRootReplacesIt) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a file of another user";
  const fs::path home = folder_ / "home", file = home / "sensor.yaml";
  fs::create_directory(home);
  write_atomically(file, "old");
  ASSERT_EQ(::chown(home.c_str(), kAnother, kAnother), 0);
  ASSERT_EQ(::chown(file.c_str(), kAnother, kAnother), 0);
  ::chmod(file.c_str(), 04640);
  write_atomically(file, "new");
  struct stat now {};
  ::stat(file.c_str(), &now);
  EXPECT_EQ(now.st_uid, kAnother);
  EXPECT_EQ(now.st_mode & 07777, 0640U);
}

TEST_F(AtomicFile, BehindALinkOfAnotherUserIsNotTouched) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a link of another user";
  write_atomically(folder_ / "precious", "old");
  const fs::path link = folder_ / "sensor.yaml";
  fs::create_symlink("precious", link);
  ASSERT_EQ(::lchown(link.c_str(), kAnother, kAnother), 0);
  EXPECT_THROW(write_atomically(link, "new"), ConfigError);
  EXPECT_THROW(check_replaceable(link), ConfigError);
  EXPECT_EQ(read_text(folder_ / "precious"), "old");
}

TEST_F(AtomicFile, StaysWhenTheDiskIsFull) {
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, "old");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  ::getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{100, old.rlim_max};  // bytes
  ::setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_atomically(file, std::string(200, 'x')), std::runtime_error);
  ::setrlimit(RLIMIT_FSIZE, &old);
  EXPECT_EQ(read_text(file), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFile, ThatIsWriteProtectedIsNotReplaceable) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everything";
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, "old");
  EXPECT_NO_THROW(check_replaceable(file));
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_THROW(check_replaceable(file), ConfigError);
}

TEST_F(AtomicFile, IsCheckedBeforeTheWork) {
  EXPECT_NO_THROW(check_replaceable(folder_ / "new.yaml"));
  EXPECT_THROW(check_replaceable(folder_ / "none" / "new.yaml"), ConfigError);
  EXPECT_THROW(check_replaceable(folder_), ConfigError);
  EXPECT_THROW(check_replaceable("/dev/null"), ConfigError);
  EXPECT_THROW(read_text(folder_), ConfigError);
}

TEST_F(AtomicFile, IsWrittenUnderANameThatNobodyCanForesee) {
  const fs::path file = folder_ / "out.csv";
  const NewFile first(file);
  const NewFile second(file);
  EXPECT_NE(first.temporary(), second.temporary());
  EXPECT_TRUE(first.temporary().filename().string().starts_with(".out.csv.tagwrench-"));
  struct stat now {};
  ::stat(first.temporary().c_str(), &now);
  EXPECT_EQ(now.st_mode & 0777, 0600U) << "until it has its name";
}

TEST_F(AtomicFile, OfAKilledWriterIsRemovedByTheNextAndOneThatIsWrittenStays) {
  const fs::path file = folder_ / "out.csv";
  const fs::path left = folder_ / ".out.csv.tagwrench-abcdef";
  const fs::path folder_left = folder_ / ".out.csv.tagwrench-ghijkl";
  const fs::path foreign = folder_ / ".out.csv.tagwrench-abcdefg";
  for (const fs::path& one : {left, foreign}) write_atomically(one, "half");
  fs::create_directory(folder_left);
  write_atomically(folder_left / "000000.png", "half");
  NewFile other(file);  // another writer, who lives
  write_atomically(file, "whole");
  EXPECT_FALSE(fs::exists(left));
  EXPECT_FALSE(fs::exists(folder_left));
  EXPECT_TRUE(fs::exists(foreign)) << "it is no name of ours";
  EXPECT_TRUE(fs::exists(other.temporary()));
  other.take_the_name();
  EXPECT_EQ(read_text(file), "");
}

TEST_F(AtomicFile, ALinkAtALeftOversNameLeadsNowhere) {
  write_atomically(folder_ / "precious", "mine");
  fs::create_symlink(folder_ / "precious", folder_ / ".out.csv.tagwrench-abcdef");
  write_atomically(folder_ / "out.csv", "new");
  EXPECT_EQ(read_text(folder_ / "precious"), "mine");
}

TEST_F(AtomicFile, ThatIsRefusedLeavesWhatIsThere) {
  const fs::path file = folder_ / "out.csv";
  NewFile late(file);
  late.write("late");
  write_atomically(file, "first");
  EXPECT_THROW(late.take_the_name(NewFile::Existing::refused), std::runtime_error);
  EXPECT_EQ(read_text(file), "first");
}

TEST_F(AtomicFile, AFolderAppearsWhole) {
  const fs::path place = folder_ / "frames";
  {
    NewFolder given_up(place);
    given_up.add("000000.pgm", "P5");
  }
  EXPECT_EQ(files(), 0U);
  NewFolder made(place);
  made.add("000000.pgm", "P5");
  EXPECT_THROW(made.add("000000.pgm", "P5"), std::runtime_error);
  EXPECT_FALSE(fs::exists(place));
  made.take_the_name();
  EXPECT_EQ(read_text(place / "000000.pgm"), "P5");
}

TEST_F(AtomicFile, OnlyRegularFilesOfBoundedSizeAreRead) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(read_text(pipe), ConfigError);  // would be waited for
  EXPECT_THROW(read_text("/dev/zero"), ConfigError);
  EXPECT_EQ(text_of_file(pipe), std::nullopt);
  write_atomically(folder_ / "a", "12345");
  EXPECT_EQ(read_text(folder_ / "a", 5), "12345");
  EXPECT_THROW(read_text(folder_ / "a", 4), ConfigError);
  EXPECT_FALSE(read_text("/proc/self/status").empty()) << "which tells no size";
}

}  // namespace
}  // namespace tagwrench
