#include "protocol/pattern.h"

#include <gtest/gtest.h>

#include <vector>

namespace tagwrench::link {
namespace {

TEST(Pattern, RepeatsAfter32767BitsAndNotBeforeFromAnySeed) {
  std::vector<bool> seen(kPatternBits + 1);
  std::uint16_t state = 1;
  for (int bit = 0; bit < kPatternBits; ++bit) {
    ASSERT_NE(state, 0);
    ASSERT_LE(state, kPatternBits);
    ASSERT_FALSE(seen[state]) << "after " << bit << " bits";
    seen[state] = true;
    state = next_pattern_state(state);
  }
  EXPECT_EQ(state, 1);
}

TEST(Pattern, AnyFifteenNeighboursOccurOnce) {
  std::vector<bool> seen(kPatternBits + 1);
  std::uint16_t state = 0x1234;
  unsigned window = 0;
  for (int bit = 0; bit < kPatternBits + 14; ++bit) {
    window = (window << 1 | (pattern_light(state) ? 1 : 0)) & kPatternBits;
    state = next_pattern_state(state);
    if (bit < 14) continue;
    ASSERT_FALSE(seen[window]);
    seen[window] = true;
  }
  EXPECT_FALSE(seen[0]) << "never dark for 15 bits";
}

TEST(Pattern, IsLightHalfOfTheTime) {
  std::uint16_t state = 77;
  int light = 0;
  for (int bit = 0; bit < kPatternBits; ++bit, state = next_pattern_state(state)) {
    light += pattern_light(state) ? 1 : 0;
  }
  EXPECT_EQ(light, 16384);
}

}  // namespace
}  // namespace tagwrench::link
