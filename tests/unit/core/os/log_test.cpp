#include "host/core/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

constexpr std::chrono::milliseconds kSoon{5};

struct Stream {
  UniqueFd ours;    ///< to write to, blocking
  UniqueFd theirs;  ///< to read from, if ever
};

Stream a_pipe() {
  int fds[2];
  EXPECT_EQ(::pipe2(fds, O_CLOEXEC), 0);
  return {UniqueFd(fds[1]), UniqueFd(fds[0])};
}

Stream a_socket() {
  int fds[2];
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fds), 0);
  return {UniqueFd(fds[1]), UniqueFd(fds[0])};
}

Stream a_terminal() {
  UniqueFd master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  EXPECT_EQ(::grantpt(master.get()), 0);
  EXPECT_EQ(::unlockpt(master.get()), 0);
  UniqueFd terminal(::open(::ptsname(master.get()), O_RDWR | O_NOCTTY | O_CLOEXEC));
  return {std::move(terminal), std::move(master)};
}

/// A write that waits would hang here, and the test's timeout tell.
TEST(WriteSoon, GivesUpOnAStreamThatNobodyReads) {
  for (const auto& make : {a_pipe, a_socket, a_terminal}) {
    const Stream stream = make();
    const std::string line(100, 'x');
    ASSERT_TRUE(write_soon(stream.ours.get(), line, kSoon));
    int lines = 1;
    while (lines < 100'000 && write_soon(stream.ours.get(), line, kSoon)) ++lines;
    EXPECT_LT(lines, 100'000);
    EXPECT_FALSE(write_soon(stream.ours.get(), line, kSoon)) << "still full";
    EXPECT_EQ(::fcntl(stream.ours.get(), F_GETFL) & O_NONBLOCK, 0) << "others' view stays";
  }
}

TEST(WriteSoon, WritesAllOfItWhereThereIsRoom) {
  const Stream stream = a_pipe();
  ASSERT_TRUE(write_soon(stream.ours.get(), "rest pose learned\n", kSoon));
  char read[64];
  ASSERT_EQ(::read(stream.theirs.get(), read, sizeof read), 18);
  EXPECT_EQ(std::string(read, 18), "rest pose learned\n");
}

TEST(WriteSoon, AppendsToAFileWhereOthersWriteToo) {
  std::string name = testing::TempDir() + "write_soon.XXXXXX";
  const UniqueFd file(::mkostemp(name.data(), O_CLOEXEC));
  ASSERT_EQ(::write(file.get(), "one\n", 4), 4);
  EXPECT_TRUE(write_soon(file.get(), "two\n", kSoon));
  ASSERT_EQ(::write(file.get(), "three\n", 6), 6);
  char read[64];
  ASSERT_EQ(::pread(file.get(), read, sizeof read, 0), 14);
  EXPECT_EQ(std::string(read, 14), "one\ntwo\nthree\n");
  ::unlink(name.c_str());
}

TEST(WriteSoon, AReaderThatHasGoneIsNoSignal) {
  Stream stream = a_pipe();
  stream.theirs.reset();
  EXPECT_FALSE(write_soon(stream.ours.get(), "line\n", kSoon));
  Stream socket = a_socket();
  socket.theirs.reset();
  EXPECT_FALSE(write_soon(socket.ours.get(), "line\n", kSoon));
}

TEST(Log, ALineOfOthersIsOneLineThatNoTerminalObeys) {
  const Stream stream = a_pipe();
  const UniqueFd before(::dup(STDERR_FILENO));
  ::dup2(stream.ours.get(), STDERR_FILENO);
  log_info("camera: \x1b]0;pwned\x07 of\ntwo lines");
  ::dup2(before.get(), STDERR_FILENO);
  std::string heard(200, '\0');
  heard.resize(static_cast<std::size_t>(
      std::max<ssize_t>(0, ::read(stream.theirs.get(), heard.data(), heard.size()))));
  EXPECT_EQ(heard, "tagwrench: camera: \\x1b]0;pwned\\x07 of two lines\n");
}

}  // namespace
}  // namespace tagwrench
