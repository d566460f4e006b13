#include "host/core/sleep_watch.h"

#include <gtest/gtest.h>

namespace tagwrench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(SleepWatch, TellsEverySleepOnceAndNoPauseBetweenTwoClocks) {
  SleepWatch watch(seconds(100));
  EXPECT_FALSE(watch.woke(seconds(100)));
  EXPECT_FALSE(watch.woke(seconds(100) + milliseconds(900)));
  EXPECT_FALSE(watch.woke(seconds(99)));
  EXPECT_TRUE(watch.woke(seconds(3700)));
  EXPECT_FALSE(watch.woke(seconds(3700)));
  EXPECT_TRUE(watch.woke(seconds(3702)));
}

TEST(SleepWatch, AComputerThatIsAwakeSleepsNoMore) {
  SleepWatch watch(time_asleep());
  EXPECT_GE(time_asleep(), -milliseconds(1));
  EXPECT_FALSE(watch.woke(time_asleep()));
}

}  // namespace
}  // namespace tagwrench
