// A disk that is full ends a recording, and what was there stays readable.
#include <sys/resource.h>

#include "host/record/database.h"
#include "tests/unit/record/recorded.h"

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
  const std::string line = writer.finish();
  limit(before_.rlim_cur);
  EXPECT_NE(line.find("r.twr"), std::string::npos) << line;
  EXPECT_NE(line.find("what was recorded until then is kept"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);

  RecordingReader reader(path());
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
