#include "host/tools/reading/reader.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "fake_hidapi.h"
#include "golden.h"
#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "tests/cli/bridge.h"

namespace tagwrench {
namespace {

using test::numbered_report;
using test::plug;

class ReadLoop : public ::testing::Test {
 protected:
  ReadLoop() {
    options_.nodes = folder_.path();
    options_.hidraw_class = test::hidraw_class();
    options_.log = folder_ / "log.csv";
  }
  ~ReadLoop() override { test::unplug_all(); }

  int read() { return read_hid(options_, stop_.get()); }
  void stop() { ::eventfd_write(stop_.get(), 1); }
  /// As the kernel announces a new device.
  void make_node(const std::string& name) { test::write_file(folder_ / name, ""); }
  /// The column of each logged row.
  std::vector<std::string> logged(int column) const {
    std::vector<std::string> cells;
    std::istringstream file(test::read_file(folder_ / "log.csv"));
    for (std::string line; std::getline(file, line);) {
      std::istringstream row(line);
      std::string cell;
      for (int i = 0; i <= column; ++i) std::getline(row, cell, ',');
      cells.push_back(cell);
    }
    return cells;
  }

  test::TemporaryFolder folder_;
  UniqueFd stop_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  ReadOptions options_;
};

TEST_F(ReadLoop, WithoutADeviceItSaysSoAtOnce) {
  EXPECT_THROW(read(), ConfigError);
  options_.device = "bench";
  plug({.path = "/dev/hidraw0", .serial = L"other"});
  EXPECT_THROW(read(), ConfigError);
}

TEST_F(ReadLoop, EachSampleIsLoggedUntilASignal) {
  const auto hid =
      plug({.path = "/dev/hidraw0",
            .reports = {numbered_report(1), {1, 2}, numbered_report(2), {}, numbered_report(5)}});
  hid->idle = [this] { stop(); };
  EXPECT_EQ(read(), 0);
  EXPECT_EQ(logged(1), (std::vector<std::string>{"seq", "1", "2", "5"}));
  EXPECT_EQ(logged(17), (std::vector<std::string>{"missing", "0", "0", "2"}));
}

TEST_F(ReadLoop, TheWatchdogsNeutralSamplesAreNoGap) {
  const auto hid =
      plug({.path = "/dev/hidraw0",
            .reports = {numbered_report(7), test::golden_reports()[2].bytes, numbered_report(8)}});
  hid->idle = [this] { stop(); };
  EXPECT_EQ(read(), 0);
  EXPECT_EQ(logged(17), (std::vector<std::string>{"missing", "0", "0", "0"}));
}

TEST_F(ReadLoop, ADeviceThatGoesAwayIsAFailure) {
  plug({.path = "/dev/hidraw0", .gone = true, .reports = {numbered_report(1)}});
  EXPECT_EQ(read(), 1);
  EXPECT_EQ(logged(1), (std::vector<std::string>{"seq", "1"}));
}

TEST_F(ReadLoop, WhoWaitsGoesOnWhenTheSameDeviceIsBack) {
  options_.wait = true;
  const auto first =
      plug({.path = "/dev/hidraw0", .serial = L"left", .reports = {numbered_report(900)}});
  first->idle = [&] {
    first->gone = true;
    test::unplug_all();
    plug({.path = "/dev/hidraw0", .serial = L"right", .reports = {numbered_report(77)}});
    const auto again = plug({.path = "/dev/hidraw1",
                             .serial = L"left",
                             .reports = {numbered_report(1), numbered_report(2)}});
    again->idle = [this] { stop(); };
    make_node("hidraw1");
  };
  EXPECT_EQ(read(), 0);
  EXPECT_EQ(logged(1), (std::vector<std::string>{"seq", "900", "1", "2"}));
  EXPECT_EQ(logged(17), (std::vector<std::string>{"missing", "0", "0", "0"}));
}

TEST_F(ReadLoop, ADeviceThatMayNotBeOpenedIsAnErrorUnlessOneWaits) {
  const auto hid = plug({.path = "/dev/hidraw0", .opens = false});
  EXPECT_THROW(read(), ConfigError);
  options_.wait = true;
  stop();
  EXPECT_EQ(read(), 0);
}

TEST_F(ReadLoop, PucksAreReadAsCounts) {
  const auto hid =
      plug({.path = "/dev/hidraw0",
            .vendor = 0x046d,
            .product = 0xc626,
            .usage_page = 1,
            .usage = 8,
            .reports = {{1, 5, 0, 0, 0, 0, 0}, {2, 0, 0, 0, 0, 7, 0}, {3, 1}, {23, 9}}});
  hid->idle = [this] { stop(); };
  EXPECT_EQ(read(), 0);
  EXPECT_EQ(logged(1), (std::vector<std::string>{"x", "5", "5", "5"}));
  EXPECT_EQ(logged(6), (std::vector<std::string>{"rz", "0", "7", "7"}));
  EXPECT_EQ(logged(7), (std::vector<std::string>{"buttons", "0", "0", "1"}));
}

TEST_F(ReadLoop, ALogThatCannotBeWrittenIsRefusedBeforeAnythingIsRead) {
  plug({.path = "/dev/hidraw0", .reports = {numbered_report(1)}});
  options_.log = folder_ / "no such folder" / "log.csv";
  EXPECT_THROW(read(), ConfigError);
}

}  // namespace
}  // namespace tagwrench
