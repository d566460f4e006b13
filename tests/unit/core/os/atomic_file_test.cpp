#include "host/core/os/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "host/core/config_error.h"
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

}  // namespace
}  // namespace tagwrench
