#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/app/pipeline.h"

namespace tagwrench::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

class Shown final : public Output {
 public:
  bool notice(std::string_view line) noexcept override {
    lines.emplace_back(line);
    return true;
  }
  std::vector<std::string> lines;
};

class StatusLinesTest : public testing::Test {
 protected:
  static Track track(Status status, Diagnostic diagnostic) {
    Track track;
    track.status = status;
    track.diagnostic = diagnostic;
    return track;
  }

  Shown shown_;
  std::array<Output*, 1> outputs_{&shown_};
  StatusLines lines_{outputs_};
};

TEST_F(StatusLinesTest, ALineGoesToEveryOutputAndAnEmptyOneNowhere) {
  lines_.say("the camera went away");
  lines_.say({});
  EXPECT_THAT(shown_.lines, ElementsAre("the camera went away"));
}

TEST_F(StatusLinesTest, WhatIsNoTroubleIsSaidOnce) {
  lines_.say_diagnostic(track(Status::ok, Diagnostic::rest_learned));
  lines_.say_diagnostic(track(Status::ok, Diagnostic::rest_learned));
  EXPECT_THAT(shown_.lines, SizeIs(1));
  EXPECT_THAT(lines_.trouble(), IsEmpty());
}

TEST_F(StatusLinesTest, ATroubleIsKeptAndTakenAwayOnceTheTargetIsHeld) {
  lines_.say_diagnostic(track(Status::lost, Diagnostic::image_black));
  ASSERT_THAT(shown_.lines, SizeIs(1));
  EXPECT_EQ(lines_.trouble(), shown_.lines.front());
  lines_.say_diagnostic(track(Status::ok, Diagnostic::none));
  lines_.say_diagnostic(track(Status::ok, Diagnostic::none));
  EXPECT_THAT(shown_.lines, ElementsAre(lines_.trouble(), ""));
}

}  // namespace
}  // namespace tagwrench::test
