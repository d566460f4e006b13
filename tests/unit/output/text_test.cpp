#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "host/core/config_error.h"
#include "host/core/os/termination.h"
#include "host/output/line_outputs.h"
#include "samples.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

std::string slurp(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class Text : public ::testing::Test {
 protected:
  void SetUp() override {
    signal(SIGPIPE, SIG_IGN);  // as main() does
    int ends[2];
    ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
    reader_.reset(ends[0]);
    writer_.reset(ends[1]);
  }
  std::string fd_path(const UniqueFd& fd) { return "/proc/self/fd/" + std::to_string(fd.get()); }
  std::string drain() {
    fcntl(reader_.get(), F_SETFL, O_NONBLOCK);
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(reader_.get(), buffer, sizeof buffer)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(n));
    }
    return text;
  }

  test::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path(), path_ = folder_ + "/out";
  UniqueFd reader_, writer_;
  LineBuffer buffer_{};
};

TEST_F(Text, JsonLineHasTheKeysInOrder) {
  EXPECT_EQ(json_line(buffer_, test::ok_sample()),
            "{\"seq\":41,\"t_ns\":123456789,\"status\":\"ok\","
            "\"d_m\":[1e-06,-2e-06,0.5],\"d_rad\":[0.125,0,-1],"
            "\"d_sigma\":[1e-07,2e-07,3e-07,4e-05,5e-05,6e-05],"
            "\"f_n\":[0.1,-0.25,3],\"m_nm\":[0.001,-0.002,0],"
            "\"w_sigma\":[0.01,0.02,0.03,0.0001,0.0002,0.0003],"
            "\"dropped\":2,\"latency_us\":812}\n");
}

TEST_F(Text, CsvLineHasTheColumnsOfTheHeader) {
  EXPECT_EQ(csv_line(buffer_, test::ok_sample()),
            "41,123456789,ok,1e-06,-2e-06,0.5,0.125,0,-1,1e-07,2e-07,3e-07,4e-05,5e-05,6e-05,"
            "0.1,-0.25,3,0.001,-0.002,0,0.01,0.02,0.03,0.0001,0.0002,0.0003,2,812\n");
  const std::string_view row = csv_line(buffer_, test::ok_sample());
  EXPECT_EQ(std::count(row.begin(), row.end(), ','),
            std::count(kCsvHeader.begin(), kCsvHeader.end(), ','));
}

TEST_F(Text, NumbersReadBackToTheSameBits) {
  Sample s = test::ok_sample();
  s.wrench << 1.0 / 3, -1e-300, 6.02214076e23, 0.1 + 0.2, -2.0 / 7, 5e-324;
  const auto json = nlohmann::json::parse(json_line(buffer_, s));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(json["f_n"][static_cast<std::size_t>(i)].get<double>(), s.wrench[i]);
    EXPECT_EQ(json["m_nm"][static_cast<std::size_t>(i)].get<double>(), s.wrench[i + 3]);
  }
}

TEST_F(Text, TheLongestSampleFits) {
  Sample s = test::ok_sample();
  s.status = Status::saturated;
  for (Vector6* v : {&s.displacement, &s.displacement_sigma, &s.wrench, &s.wrench_sigma}) {
    v->setConstant(-2.2250738585072014e-308);
  }
  s.sequence = std::numeric_limits<std::uint64_t>::max();
  s.dropped = std::numeric_limits<std::uint32_t>::max();
  s.capture_time = TimePoint::min();
  s.output_time = TimePoint::max();
  EXPECT_EQ(json_line(buffer_, s).back(), '\n');
  EXPECT_EQ(csv_line(buffer_, s).back(), '\n');
}

TEST_F(Text, AStatusWithoutNumbersHasZerosEverywhere) {
  for (const Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    Sample s = test::ok_sample();
    s.status = status;
    const auto json = nlohmann::json::parse(json_line(buffer_, s));
    EXPECT_EQ(json["status"], name(status));
    for (const char* key : {"d_m", "d_rad", "d_sigma", "f_n", "m_nm", "w_sigma"}) {
      for (const auto& number : json[key]) EXPECT_EQ(number.get<double>(), 0) << key;
    }
  }
}

TEST_F(Text, NanIsDoubtfulAndStaysJson) {
  Sample s = test::ok_sample();
  s.displacement_sigma[2] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(nlohmann::json::parse(json_line(buffer_, s))["status"], "doubtful");
}

TEST_F(Text, LatencyCountsFromItsOriginAndIsNeverNegative) {
  Sample s = test::ok_sample();
  s.output_time = s.latency_origin + std::chrono::microseconds(812);
  EXPECT_EQ(latency_us(s), 812);
  s.output_time = s.latency_origin - std::chrono::microseconds(5);
  EXPECT_EQ(latency_us(s), 0);
}

TEST_F(Text, AFileIsCreatedAfresh) {
  std::ofstream(path_) << "old text that is much longer than nothing";
  {
    CsvOutput out(path_, false);
    EXPECT_EQ(out.send(test::ok_sample()), SendStatus::ok);
  }
  const std::string text = slurp(path_);
  EXPECT_EQ(text.substr(0, kCsvHeader.size()), kCsvHeader);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST_F(Text, APathThatCannotBeWrittenIsOneLineWithThePath) {
  for (const std::string& path : {folder_, folder_ + "/none/out", std::string()}) {
    try {
      JsonlOutput out(path, false);
      FAIL() << path;
    } catch (const ConfigError& error) {
      EXPECT_EQ(std::string(error.what()).find(path), 0u);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST_F(Text, ANamedPipeWithoutReaderIsAnErrorAndNoWait) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THROW(JsonlOutput(path_, true), ConfigError);
}

TEST_F(Text, AFullDiskFailsWithTheFileAndTheRemedy) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full";
  JsonlOutput json("/dev/full", false);
  EXPECT_EQ(json.send(test::ok_sample()), SendStatus::failed);
  EXPECT_EQ(json.send(test::ok_sample()), SendStatus::failed);
  EXPECT_EQ(json.failure(),
            "/dev/full: cannot be written: No space left on device; free some space, or write "
            "somewhere else");
  CsvOutput csv("/dev/full", false);
  EXPECT_EQ(csv.send(test::ok_sample()), SendStatus::failed);
}

TEST_F(Text, AFileThatTakesHalfALineKeepsWholeLinesOnly) {
  const pid_t child = fork();
  if (child == 0) {
    // The limit on the file's size makes the kernel write a part, as a full disk does.
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    JsonlOutput out(path_, false);
    int sent = 0;
    while (out.send(test::ok_sample()) == SendStatus::ok) ++sent;
    _exit(out.failure().find(path_) == 0 ? sent : 99);
  }
  int state = 0;
  waitpid(child, &state, 0);
  const int sent = WEXITSTATUS(state);
  EXPECT_GT(sent, 0);
  const std::string text = slurp(path_);
  EXPECT_LT(text.size(), 1000u);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), sent);
}

TEST_F(Text, AClosedPipeFailsWithOneLine) {
  JsonlOutput out(fd_path(writer_), false);
  reader_.reset();
  EXPECT_EQ(out.send(test::ok_sample()), SendStatus::failed);
  EXPECT_NE(out.failure().find("reader has gone"), std::string::npos);
}

TEST_F(Text, ASlowReaderLosesWholeLinesAndSeesTheGap) {
  JsonlOutput out(fd_path(writer_), false);
  Sample s = test::ok_sample();
  std::uint64_t accepted = 0;
  for (s.sequence = 0; s.sequence < 2000; ++s.sequence) {
    const SendStatus status = out.send(s);
    ASSERT_NE(status, SendStatus::failed);
    if (status == SendStatus::ok) ++accepted;
  }
  EXPECT_LT(accepted, 2000u);
  std::string text = drain();
  EXPECT_EQ(out.send(s), SendStatus::ok);  // the reader is back
  text += drain();
  std::istringstream lines(text);
  std::uint64_t count = 0, last = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    last = nlohmann::json::parse(line)["seq"].get<std::uint64_t>();
  }
  EXPECT_EQ(count, accepted + 1);
  EXPECT_EQ(last, 2000u);
}

TEST_F(Text, LosslessWaitsForTheReader) {
  std::uint64_t lines = 0;
  std::thread reader([&] {
    char buffer[512];
    for (ssize_t n; (n = read(reader_.get(), buffer, sizeof buffer)) > 0;) {
      lines += static_cast<std::uint64_t>(std::count(buffer, buffer + n, '\n'));
    }
  });
  {
    JsonlOutput out(fd_path(writer_), true);
    writer_.reset();
    for (int i = 0; i < 2000; ++i) ASSERT_EQ(out.send(test::ok_sample()), SendStatus::ok);
  }
  reader.join();
  EXPECT_EQ(lines, 2000u);
}

/// How many of 2000 lines went into a pipe that nobody reads before one was not waited for.
int lines_before_giving_way(JsonlOutput& out) {
  int lines = 0;
  while (lines < 2000 && out.send(test::ok_sample()) != SendStatus::skipped) ++lines;
  return lines;
}

TEST_F(Text, LosslessWritesWhatThereIsRoomForAfterTerminationAndWaitsNoMore) {
  const pid_t child = fork();
  if (child == 0) {
    const UniqueFd caught = termination_fd();
    JsonlOutput out(fd_path(writer_), true);
    kill(getpid(), SIGTERM);
    const int lines = lines_before_giving_way(out);
    _exit(lines > 0 && lines < 2000 ? 7 : 0);
  }
  int state = 0;
  waitpid(child, &state, 0);
  EXPECT_EQ(WEXITSTATUS(state), 7);
}

TEST_F(Text, LosslessWaitEndsWithATerminationThatAnotherThreadTakes) {
  const pid_t child = fork();
  if (child == 0) {
    const UniqueFd caught = termination_fd();
    JsonlOutput out(fd_path(writer_), true);
    std::thread other([this] {
      pollfd room{writer_.get(), POLLOUT, 0};
      while (poll(&room, 1, 0) > 0) sched_yield();  // until the pipe is full
      pthread_kill(pthread_self(), SIGTERM);
    });
    const int lines = lines_before_giving_way(out);
    other.join();
    _exit(lines < 2000 ? 7 : 0);
  }
  int state = 0;
  waitpid(child, &state, 0);
  EXPECT_EQ(WEXITSTATUS(state), 7);
}

TEST_F(Text, ALinkOfAnotherUserLeadsNowhere) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a link of another user";
  const test::TemporaryFolder folder;
  const std::string link = folder.path() + "/out.jsonl";
  std::filesystem::create_symlink("precious", link);
  ASSERT_EQ(::lchown(link.c_str(), 1501, 1501), 0);
  EXPECT_THROW(TextSink(link, false), ConfigError);
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/precious"));
}

TEST_F(Text, TheReadersOwnFlagsAreLeftAlone) {
  const int before = fcntl(writer_.get(), F_GETFL);
  TextSink sink(writer_.get(), "pipe", false);
  EXPECT_EQ(sink.write("x\n"), SendStatus::ok);
  EXPECT_EQ(fcntl(writer_.get(), F_GETFL), before);
}

}  // namespace
}  // namespace tagwrench
