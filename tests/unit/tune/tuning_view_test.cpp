#include "host/verbs/tune/tuning_view.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/tune/tuned_profile.h"

namespace tagwrench {
namespace {

Tuning some_tuning(const std::string& file = "/home/me/mine.yaml") {
  return Tuning({"mine", file, false, test::kMine, test::profile_of(test::kMine)});
}

LiveReading pushed() {
  LiveReading now;
  now.status = Status::ok;
  now.wrench << 0.25, -1, 0, 0.006, 0, 0;
  now.motion << 0.5, -1, 0, 0, 0, 0;
  now.buttons = 0b101;
  now.on_trial = true;
  return now;
}

/// The lines without the control sequences at their ends.
std::vector<std::string> lines_of(std::string screen) {
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < screen.size(); ++i) {
    if (screen.compare(i, 3, "\x1b[K") == 0 || screen.compare(i, 3, "\x1b[J") == 0) {
      i += 2;
    } else if (screen.compare(i, 2, "\r\n") == 0) {
      lines.emplace_back();
      ++i;
    } else {
      lines.back() += screen[i];
    }
  }
  return lines;
}

TEST(TuningView, FitsEveryScreenAndShowsTheChosenKnob) {
  Tuning tuning = some_tuning();
  for (std::size_t chosen = 0; chosen < tuning.knobs().size(); ++chosen) {
    for (const int width : {1, 20, 40, 80, 200}) {
      for (const int height : {1, 5, 12, 24, 60}) {
        const auto lines = lines_of(tuning_view(tuning, pushed(), width, height));
        ASSERT_LE(lines.size(), static_cast<std::size_t>(height));
        bool seen = height < 12 || width < 20;
        for (const std::string& line : lines) {
          ASSERT_LE(line.size(), static_cast<std::size_t>(width)) << line;
          for (const char c : line) ASSERT_GE(c, ' ') << line;
          seen = seen || line.starts_with("> ");
        }
        ASSERT_TRUE(seen) << width << " x " << height << ", knob " << chosen;
      }
    }
    tuning.press({Key::Kind::down});
  }
}

TEST(TuningView, ShowsForceMotionAndButtonsAsTheyAre) {
  const auto lines = lines_of(tuning_view(some_tuning(), pushed(), 80, 24));
  ASSERT_EQ(lines.size(), 24U);
  EXPECT_EQ(lines[0], "tuning profile mine   /home/me/mine.yaml");
  EXPECT_EQ(lines[1], "ok   button 1 3");
  EXPECT_EQ(lines[2],
            "Fx    0.250 N    [           |======     ]   x   0.500 [           |======     ]");
  EXPECT_NE(lines[3].find("[###########|           ]"), std::string::npos)
      << "beyond full scale: " << lines[3];
  EXPECT_NE(lines[5].find("6.000 mN m"), std::string::npos) << lines[5];
}

TEST(TuningView, SaysWhenWhatIsShownIsNotInForce) {
  LiveReading now = pushed();
  now.on_trial = false;
  EXPECT_EQ(lines_of(tuning_view(some_tuning(), now, 80, 24))[1], "ok   button 1 3   not in force");
}

TEST(TuningView, ControlBytesOfAFileNameDoNotReachTheTerminal) {
  const std::string screen = tuning_view(some_tuning("/tmp/\x1b[2Jevil\a.yaml"), pushed(), 80, 24);
  EXPECT_EQ(screen.find("\x1b[2J"), std::string::npos);
  EXPECT_EQ(screen.find('\a'), std::string::npos);
}

}  // namespace
}  // namespace tagwrench
