#include <gtest/gtest.h>

#include <cmath>

#include "host/calibration/check/in_situ.h"

namespace tagwrench {
namespace {

constexpr unsigned kBothTags = 3;

/// Somebody turns a lens: the width goes from one value to another in this time, 25 frames a
/// second.
class Turning {
 public:
  FocusTurn to(double width_px, double seconds) {
    const double from = width_px_;
    const int frames = static_cast<int>(std::lround(25 * seconds));
    for (int i = 1; i <= frames; ++i) {
      width_px_ = from + (width_px - from) * i / frames;
      ++frame_;
      guide.add(TimePoint(std::chrono::milliseconds(40 * frame_)), width_px_, kBothTags);
    }
    return guide.turn();
  }

  FocusGuide guide;

 private:
  double width_px_ = 3;
  int frame_ = 0;
};

TEST(FocusGuide, SaysWhichWayItGoes) {
  Turning lens;
  EXPECT_EQ(lens.to(3, 0.2), FocusTurn::begin);
  EXPECT_EQ(lens.to(2, 2), FocusTurn::sharper);
  EXPECT_EQ(lens.to(3, 2), FocusTurn::blurrier);
  EXPECT_EQ(lens.to(3, 2), FocusTurn::away);
  EXPECT_NEAR(lens.guide.best_px(), 2, 0.05);
  EXPECT_EQ(lens.guide.now_px(), 3);
}

TEST(FocusGuide, ABestThatNothingWorseFollowsMayGetBetter) {
  Turning lens;
  lens.to(1.2, 3);
  EXPECT_EQ(lens.to(1.2, 2), FocusTurn::try_on);
  lens.to(1.8, 2);
  lens.to(1.2, 2);
  EXPECT_EQ(lens.to(1.2, 2), FocusTurn::best);
  lens.to(0.9, 2);
  EXPECT_EQ(lens.to(0.9, 2), FocusTurn::try_on) << "a new best";
}

TEST(FocusGuide, OneFrameAloneIsNoBest) {
  Turning lens;
  lens.to(2, 3);
  lens.to(0.5, 0.04);
  lens.to(2, 0.04);
  EXPECT_NEAR(lens.guide.best_px(), 2, 0.05);
}

TEST(FocusGuide, OtherTagsBeginAnew) {
  Turning lens;
  lens.to(1, 3);
  lens.guide.add(TimePoint(std::chrono::seconds(10)), 2, 1);
  EXPECT_EQ(lens.guide.turn(), FocusTurn::begin);
  EXPECT_EQ(lens.guide.best_px(), 2);
}

TEST(FocusGuide, NoiseGrowsWithTheRootOfTheBlur) {
  Turning lens;
  lens.to(1.5, 3);
  EXPECT_NEAR(lens.guide.more_noise(), 0, 0.01);
  lens.to(6, 3);
  EXPECT_NEAR(lens.guide.more_noise(), 1, 0.03);
}

}  // namespace
}  // namespace tagwrench
