#include "host/output/terminal.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cstdlib>

#include "host/core/config_error.h"
#include "samples.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

std::string drain(int fd) {
  fcntl(fd, F_SETFL, O_NONBLOCK);
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = read(fd, buffer, sizeof buffer)) > 0;) {
    text.append(buffer, static_cast<std::size_t>(n));
  }
  return text;
}

/// The text without control sequences, as lines.
std::vector<std::string> visible_lines(const std::string& screen) {
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < screen.size(); ++i) {
    if (screen[i] == '\x1b') {
      while (i + 1 < screen.size() && std::isalpha(static_cast<unsigned char>(screen[i])) == 0) ++i;
    } else if (screen[i] == '\n') {
      lines.emplace_back();
    } else if (screen[i] != '\r') {
      lines.back() += screen[i];
    }
  }
  return lines;
}

class View : public ::testing::Test {
 protected:
  View() {
    options_.full_scale << 5, 5, 5, 0.2, 0.2, 0.2;
    options_.source = "simulated sensor";
    options_.devices = {"spacemouse 256f:c62e"};
    options_.color = false;
  }
  std::vector<std::string> draw(const Sample& sample, int width, int height = 24) {
    size_ = draw_view(screen_, options_, sample, {60, 0.8, 3}, notice_, width, height, 0, count_);
    return visible_lines({screen_.data(), size_});
  }
  TerminalOptions options_;
  std::string notice_ = "said once";
  std::array<char, TextSink::kMaxBlock> screen_{};
  std::size_t size_ = 0;
  int count_ = 0;
};

TEST_F(View, ShowsValuesWithTheirUnitsAndWhereTheyComeFrom) {
  const auto lines = draw(test::ok_sample(), 100);
  ASSERT_EQ(lines.size(), 11u);
  EXPECT_EQ(count_, 11);
  EXPECT_EQ(lines[0].substr(0, 2), "ok");
  EXPECT_NE(lines[1].find("60.0 Hz   latency 0.8 ms   dropped 3"), std::string::npos);
  EXPECT_EQ(lines[3].find("Fy    -0.250 N "), 0u);
  EXPECT_NE(lines[3].find("of 5 N"), std::string::npos);
  EXPECT_EQ(lines[6].find("My    -2.000 mN m"), 0u);
  EXPECT_NE(lines[6].find("of 200 mN m"), std::string::npos);
  EXPECT_NE(lines[8].find("simulated sensor"), std::string::npos);
  EXPECT_NE(lines[10].find("said once"), std::string::npos);
}

TEST_F(View, ALongNoticeIsBrokenAtSpacesAndWholeIfThereIsRoom) {
  notice_ =
      "no tag is seen, neither tags 5 and 2 of aruco_original nor any other; are they in view?";
  const auto lines = draw(test::ok_sample(), 50);
  std::string shown;
  for (std::size_t i = 10; i < lines.size(); ++i) {
    EXPECT_LE(lines[i].size(), 50U);
    shown += lines[i].substr(8, lines[i].find_last_not_of(' ') - 7) + ' ';
  }
  EXPECT_EQ(shown, notice_ + ' ');
  EXPECT_EQ(draw(test::ok_sample(), 50, 11).size(), 11U) << "no more lines than the screen has";
}

TEST_F(View, BarsGrowFromTheMiddleWithTheSign) {
  Sample s = test::ok_sample();
  s.wrench << 5, -2.5, 0, 0.4, 0, 0;
  const auto lines = draw(s, 100);
  const auto bar = [&](std::size_t i) {
    const std::string& line = lines[i + 2];
    return line.substr(line.find('[') + 1, line.find(']') - line.find('[') - 1);
  };
  const auto middle = bar(0).size() / 2;
  EXPECT_EQ(bar(0), std::string(middle, ' ') + "|" + std::string(middle, '='));
  const std::string negative = bar(1);
  EXPECT_EQ(negative.substr(middle), "|" + std::string(middle, ' '));
  EXPECT_EQ(negative.find('='), middle - (middle + 1) / 2);  // half of the half
  EXPECT_EQ(bar(2), std::string(middle, ' ') + "|" + std::string(middle, ' '));
  EXPECT_EQ(bar(3), std::string(middle, ' ') + "|" + std::string(middle, '#'));  // beyond
}

TEST_F(View, AStatusWithoutNumbersShowsZeros) {
  Sample s = test::ok_sample();
  s.status = Status::lost;
  const auto lines = draw(s, 100);
  EXPECT_EQ(lines[0].find("lost"), 0u);
  EXPECT_EQ(lines[4].find("Fz     0.000 N"), 0u);
  EXPECT_EQ(lines[4].find('='), std::string::npos);
}

TEST_F(View, NoLineIsWiderOrHigherThanTheTerminal) {
  options_.source = std::string(5000, 'x') + "\xc3\xa9";
  options_.devices.assign(40, "device");
  for (const int width : {1, 10, 30, 59, 60, 80, 132, 500}) {
    for (const int height : {1, 4, 24}) {
      const auto lines = draw(test::ok_sample(), width, height);
      EXPECT_LE(lines.size(), static_cast<std::size_t>(height));
      for (const std::string& line : lines) EXPECT_LE(line.size(), static_cast<std::size_t>(width));
    }
  }
}

TEST_F(View, ControlCharactersOfOthersDoNotReachTheTerminal) {
  options_.source = "a\x1b[2Jb\nc";
  const auto lines = draw(test::ok_sample(), 80);
  EXPECT_EQ(lines[8], "source  a?[2Jb?c");
}

TEST(PlainLine, SaysAllInOneLine) {
  std::array<char, TextSink::kMaxBlock> line;
  const std::size_t size = format_plain_line(line, test::ok_sample(), {60.1, 0.8, 0}, 1.52);
  EXPECT_EQ(std::string(line.data(), size),
            "t 1.52 s  ok  F  0.100 -0.250  3.000 N  M    1.0   -2.0    0.0 mN m  60.1 Hz  latency "
            "0.8 ms  dropped 0\n");
}

TEST(NotATerminal, PrintsOneLineForEveryHalfSecondOfSampleTime) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  UniqueFd reader(ends[0]), writer(ends[1]);
  TerminalOptions options;
  options.fd = writer.get();
  TerminalOutput out(options);
  EXPECT_FALSE(out.notice("for people"));
  Sample s = test::ok_sample();
  for (int i = 0; i < 121; ++i) {  // 2 s at 60 Hz
    EXPECT_EQ(out.send(s), SendStatus::ok);
    s.capture_time += std::chrono::nanoseconds(16'666'667);
  }
  const std::string text = drain(reader.get());
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5);  // 0, 0.5, 1, 1.5 and 2 s
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_NE(text.find("60.0 Hz"), std::string::npos);
}

TEST(NotATerminal, ALossHasALineOfItsOwn) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  UniqueFd reader(ends[0]), writer(ends[1]);
  TerminalOptions options;
  options.fd = writer.get();
  TerminalOutput out(options);
  Sample s = test::ok_sample();
  out.send(s);
  s.status = Status::lost;  // the time is the last frame's
  out.send(s);
  EXPECT_NE(drain(reader.get()).find("lost"), std::string::npos);
}

class OnATerminal : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("TERM", "xterm", 1);
    unsetenv("NO_COLOR");
    const winsize size{24, 90, 0, 0};
    int screen = -1, program = -1;
    ASSERT_EQ(openpty(&screen, &program, nullptr, nullptr, &size), 0);
    screen_.reset(screen);
    program_.reset(program);
    options_.fd = program;
  }
  UniqueFd screen_, program_;
  TerminalOptions options_;
};

TEST_F(OnATerminal, DrawsInPlaceShowsNoticesAndGivesTheCursorBack) {
  {
    TerminalOutput out(options_);
    EXPECT_TRUE(out.notice("camera is back"));
    EXPECT_EQ(out.send(test::ok_sample()), SendStatus::ok);
    const std::string text = drain(screen_.get());
    EXPECT_NE(text.find("\x1b[?25l"), std::string::npos);
    EXPECT_NE(text.find("camera is back"), std::string::npos);
    EXPECT_NE(text.find("\x1b[32m"), std::string::npos);
    // At most 15 drawings a second: one that follows at once is not made.
    EXPECT_EQ(out.send(test::ok_sample()), SendStatus::ok);
    EXPECT_LT(drain(screen_.get()).size(), text.size());
  }
  EXPECT_NE(drain(screen_.get()).find("\n\x1b[?25h"), std::string::npos);
}

TEST_F(OnATerminal, ALossIsShownAtOnceAndSoIsTheNoticeAfterIt) {
  TerminalOutput out(options_);
  Sample s = test::ok_sample();
  out.send(s);
  drain(screen_.get());
  s = {};
  s.status = Status::lost;
  out.send(s);  // sooner than the next drawing is due, and no sample follows
  EXPECT_NE(drain(screen_.get()).find("lost"), std::string::npos);
  out.notice("the camera stopped");
  EXPECT_NE(drain(screen_.get()).find("the camera stopped"), std::string::npos);
}

TEST_F(OnATerminal, NoColorIsHonoured) {
  setenv("NO_COLOR", "1", 1);
  TerminalOutput out(options_);
  out.send(test::ok_sample());
  EXPECT_EQ(drain(screen_.get()).find("\x1b[32m"), std::string::npos);
  unsetenv("NO_COLOR");
}

TEST_F(OnATerminal, ATerminalThatTakesNothingDoesNotBlock) {
  // Nobody reads the screen: its buffer fills up, and the drawings after that are lost.
  TextSink sink(program_.get(), "terminal", false);
  const std::string block(4000, 'x');
  SendStatus status = SendStatus::ok;
  for (int i = 0; i < 100 && status == SendStatus::ok; ++i) status = sink.write(block + "\n");
  EXPECT_EQ(status, SendStatus::skipped);
  // What is half out is completed when the reader is back, before anything else.
  std::string text = drain(screen_.get());
  while (sink.write("end\n") != SendStatus::ok) text += drain(screen_.get());
  text += drain(screen_.get());
  EXPECT_EQ(std::count(text.begin(), text.end(), 'x') % 4000, 0);
}

TEST(NotATerminal, AClosedDescriptorIsAnErrorAtSetUp) {
  TerminalOptions options;
  options.fd = 1000;
  EXPECT_THROW(TerminalOutput{options}, ConfigError);
}

}  // namespace
}  // namespace tagwrench
