#include <gtest/gtest.h>

#include "host/app/pipeline.h"

namespace tagwrench::test {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(40);
constexpr Duration kGrace = milliseconds(40);
constexpr TimePoint kStart{milliseconds(1000)};

/// Frames at these times after the start.
TimePoint missing_after(std::initializer_list<int> arrivals_ms) {
  Watchdog watchdog({});
  FrameWatch frames(watchdog, kPeriod);
  frames.begin(kStart);
  for (const int ms : arrivals_ms) frames.frame_came(kStart + milliseconds(ms), kPeriod);
  return frames.missing_at();
}

TEST(FrameWatch, AFrameIsMissingAPeriodAndAGraceAfterTheLast) {
  EXPECT_EQ(missing_after({}), kStart + kPeriod + kGrace);
  EXPECT_EQ(missing_after({40}), kStart + milliseconds(40) + kPeriod + kGrace);
}

TEST(FrameWatch, OneHiccupDoesNotDelayTheNextNeutral) {
  EXPECT_EQ(missing_after({40, 80, 200}), kStart + milliseconds(200) + kPeriod + kGrace);
}

TEST(FrameWatch, ACameraThatSlowsDownIsBelieved) {
  EXPECT_EQ(missing_after({100, 200, 300}), kStart + milliseconds(300 + 100) + kGrace);
}

TEST(FrameWatch, OneThatIsSlowerThanAQuarterOfASecondIsLost) {
  EXPECT_EQ(missing_after({1000, 2000, 3000}), kStart + milliseconds(3000 + 250) + kGrace);
}

TEST(FrameWatch, FramesInABurstAreExpectedAtTheAnnouncedPeriod) {
  EXPECT_EQ(missing_after({1, 2, 3}), kStart + milliseconds(3) + kPeriod + kGrace);
}

}  // namespace
}  // namespace tagwrench::test
