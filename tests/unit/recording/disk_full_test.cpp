// A disk that is full ends a recording, and what was there stays readable.
#include <sqlite3.h>
#include <sys/resource.h>

#include <cerrno>

#include "host/recording/database.h"
#include "tests/unit/recording/recorded.h"

namespace tagwrench::record::test {
namespace {

class DiskFull : public Folder {
 protected:
  DiskFull() { ::getrlimit(RLIMIT_FSIZE, &before_); }
  ~DiskFull() override { ::setrlimit(RLIMIT_FSIZE, &before_); }
  void limit(rlim_t bytes) {
    rlimit tight = before_;
    tight.rlim_cur = bytes;
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  }
  rlimit before_{};
};

TEST_F(DiskFull, EndsWithOneLineAndKeepsWhatWasThere) {
  RecordingWriter writer({.path = path(), .lossless = true, .commit_period = Duration(0)}, head());
  limit(3 << 20);
  int frames = 0;
  for (; !writer.state().failed; frames += 10) write_frames(writer, frames, frames + 10);
  limit(before_.rlim_cur);  // as if somebody had made room: the end is missing all the same
  const std::string line = writer.finish();
  EXPECT_NE(line.find("r.twr"), std::string::npos) << line;
  EXPECT_NE(line.find("could not grow: files may have 3.15 MB here"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);

  RecordingReader reader(path());
  EXPECT_FALSE(reader.head().closed) << "its end is missing";
  EXPECT_NE(reader.unclosed(), "");
  EXPECT_NE(line.find("its first " + std::to_string(reader.frame_times().size()) + " frames, "),
            std::string::npos)
      << reader.frame_times().size() << " frames; " << line;
  EXPECT_GT(reader.frame_times().size(), 50U);
  EXPECT_LT(reader.frame_times().size(), static_cast<std::size_t>(frames));
  int read = 0;
  for (Entry entry; reader.next(entry); ++read) {
    const auto pixels = picture(read);
    ASSERT_TRUE(
        std::equal(pixels.begin(), pixels.end(), entry.raw.bytes.begin(), entry.raw.bytes.end()))
        << read;
  }
  Database database(path(), Database::Mode::read);
  Statement check(database, "PRAGMA integrity_check");
  ASSERT_TRUE(check.step());
  EXPECT_EQ(check.text(0), "ok");
}

TEST_F(DiskFull, WhatCannotBeBegunLeavesNoFile) {
  limit(40 << 10);
  const std::string line =
      refusal([&] { RecordingWriter writer({.path = path(), .lossless = true}, head()); });
  limit(before_.rlim_cur);
  EXPECT_NE(line.find("could not grow"), std::string::npos) << line;
  EXPECT_NE(line.find("nothing was recorded"), std::string::npos) << line;
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(DiskFull, TheCauseIsNamed) {
  const auto trouble = [&](int code, int system_errno) {
    return write_trouble(path(), DatabaseError("disk I/O error", code, system_errno), "all kept");
  };
  EXPECT_NE(trouble(SQLITE_FULL, 0).find("the disk is full; all kept; free"), std::string::npos);
  EXPECT_NE(trouble(SQLITE_IOERR_WRITE, EFBIG).find("no larger files (FAT"), std::string::npos);
  EXPECT_NE(trouble(SQLITE_IOERR_WRITE, EDQUOT).find("your quota"), std::string::npos);
  EXPECT_NE(trouble(SQLITE_IOERR_SHMSIZE, ENOSPC).find("the disk is full"), std::string::npos);
  EXPECT_EQ(trouble(SQLITE_IOERR_WRITE, EIO).find("could not grow"), std::string::npos);
}

TEST_F(DiskFull, ALoopThatGoesOnIsNotHeldUp) {
  RecordingWriter writer({.path = path(), .lossless = true, .buffer_bytes = 3 << 20}, head());
  limit(1 << 20);
  // Much more than fits into the buffer: a writer that stopped emptying it would never come back.
  write_frames(writer, 0, 20'000);
  EXPECT_TRUE(writer.state().failed);
  EXPECT_NE(writer.finish(), "");
}

}  // namespace
}  // namespace tagwrench::record::test
