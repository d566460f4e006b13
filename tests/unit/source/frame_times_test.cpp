#include <gtest/gtest.h>

#include <random>

#include "host/source/replay.h"
#include "tests/unit/source/message.h"

namespace tagwrench {
namespace {

const std::vector<std::string> kFiles = {"a.png", "b.png", "c.png"};

std::vector<std::int64_t> times(std::string_view text) {
  std::vector<std::int64_t> out;
  for (const Duration time : parse_frame_times(text, "D/frames.csv", kFiles))
    out.push_back(time.count());
  return out;
}

std::string refused_times(std::string_view text) {
  return refusal([&] { parse_frame_times(text, "D/frames.csv", kFiles); });
}

TEST(FrameTimes, HeaderIsOptionalAndLineEndsAreFree) {
  const std::vector<std::int64_t> expected = {0, 40, 90};
  EXPECT_EQ(times("file,t_ns\na.png,0\nb.png,40\nc.png,90\n"), expected);
  EXPECT_EQ(times("a.png,0\nb.png,40\nc.png,90"), expected);
  EXPECT_EQ(times("file,t_ns\r\na.png,0\r\nb.png,40\r\nc.png,90\r\n\r\n"), expected);
}

TEST(FrameTimes, LinesMayBeInAnyOrder) {
  EXPECT_EQ(times("c.png,90\na.png,0\nb.png,40\n"), (std::vector<std::int64_t>{0, 40, 90}));
}

TEST(FrameTimes, EachFaultNamesItsLine) {
  EXPECT_TRUE(
      names(refused_times("a.png,0\nb.png;40\nc.png,90\n"), {"D/frames.csv:2:", "b.png;40"}));
  EXPECT_TRUE(names(refused_times("a.png,0\nb.png,4x\nc.png,90\n"),
                    {"D/frames.csv:2:", "whole nanoseconds"}));
  EXPECT_TRUE(names(refused_times("a.png,0\nb.png,-4\nc.png,90\n"), {"D/frames.csv:2:"}));
  EXPECT_TRUE(
      names(refused_times("a.png,0\nb.png,99999999999999999999\nc.png,90\n"), {"D/frames.csv:2:"}));
  EXPECT_TRUE(names(refused_times("a.png,0\nb.png,1.5\nc.png,90\n"), {"D/frames.csv:2:"}));
  EXPECT_TRUE(names(refused_times("file,t_ns\na.png,0\nz.png,40\n"),
                    {"D/frames.csv:3:", "no picture", "z.png"}));
  EXPECT_TRUE(names(refused_times("a.png,0\nb.png,40\nb.png,50\nc.png,90\n"),
                    {"D/frames.csv:3:", "line 2"}));
  EXPECT_TRUE(names(refused_times("a.png,0\nfile,t_ns\n"), {"D/frames.csv:2:"}));
}

TEST(FrameTimes, EveryPictureNeedsATime) {
  EXPECT_TRUE(names(refused_times("a.png,0\nc.png,90\n"), {"D/frames.csv", "no time for b.png"}));
  EXPECT_TRUE(names(refused_times(""), {"no time for a.png"}));
}

TEST(FrameTimes, TimesMustIncreaseInTheOrderOfNames) {
  EXPECT_TRUE(
      names(refused_times("a.png,0\nb.png,40\nc.png,40\n"), {"D/frames.csv:3:", "c.png", "40"}));
  EXPECT_TRUE(names(refused_times("c.png,10\nb.png,40\na.png,0\n"), {"D/frames.csv:1:", "c.png"}));
}

TEST(FrameTimes, MessagesStayOnePrintableLine) {
  EXPECT_TRUE(names(refused_times("a.png,0\n\x1b[2J\x07\n"), {"?[2J?"}));
  EXPECT_LT(refused_times(std::string(100000, 'x')).size(), 300U);
}

TEST(FrameTimes, SurvivesDamage) {
  std::mt19937 random(11);
  const std::string good = "file,t_ns\na.png,0\nb.png,40000000\nc.png,90000000\n";
  int refusals = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string text = good;
    for (int i = 0; i < 2; ++i) text[random() % text.size()] = static_cast<char>(random());
    text.resize(random() % (text.size() + 1));
    const std::string message = refused_times(text);
    if (message.empty()) continue;
    ++refusals;
    ASSERT_EQ(message.find('\n'), std::string::npos);
  }
  EXPECT_GT(refusals, 3000);
}

}  // namespace
}  // namespace tagwrench
