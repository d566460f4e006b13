// `run --open` and `--web-token`: who may see the pages, and what other users of the machine see of
// the token.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <fstream>

#include "tests/cli/bridge.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {
namespace {

class Pages : public testing::Test {
 protected:
  /// A browser that tells through a FIFO what it was started with.
  Pages() {
    EXPECT_EQ(::mkfifo(opened_.c_str(), 0600), 0);
    folder_.write("bin/xdg-open", "#!/bin/sh\necho \"$@\" > " + opened_ + "\n");
    std::filesystem::permissions(folder_ / "bin/xdg-open", std::filesystem::perms::owner_all);
    // A shell takes the last of two PATHs: not among the surroundings.
    ::setenv("PATH", ((folder_ / "bin").string() + ":" + std::getenv("PATH")).c_str(), 1);
    ::setenv("DISPLAY", ":99", 1);
    ::setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
  }
  /// The browser's arguments; empty: none was started.
  std::string opened() const {
    const UniqueFd fifo(::open(opened_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    pollfd waiting{fifo.get(), POLLIN, 0};
    std::array<char, 1024> bytes;
    if (::poll(&waiting, 1, 20'000) != 1) return {};
    const ssize_t got = ::read(fifo.get(), bytes.data(), bytes.size());
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
  }

  TemporaryFolder folder_;
  std::string opened_ = folder_ / "opened";
};

TEST_F(Pages, AreOpenedWithoutTheTokenWhichEveryUserCouldRead) {
  const std::string token = folder_ / "token";
  Bridge sensor({"run", "--source", "sim", "--seconds", "60", "--output", "web:127.0.0.1:0",
                 "--open", "--web-token", token});
  ASSERT_TRUE(sensor.wait_for_message("pages: "));
  const std::string address = opened();
  EXPECT_TRUE(address.starts_with("http://127.0.0.1:")) << address;
  EXPECT_EQ(address.find("token"), std::string::npos) << address;
  ASSERT_TRUE(sensor.wait_for_message("(the token is in " + token + ")"));
  std::string text;
  std::getline(std::ifstream(token), text);
  ASSERT_EQ(text.size(), 43U);
  EXPECT_EQ(sensor.err().find(text), std::string::npos) << "a log, which others may read";
  sensor.signal(SIGTERM);
  EXPECT_EQ(sensor.finish().status, 0);
}

}  // namespace
}  // namespace tagwrench::test
