#include "protocol/version.h"

#include <gtest/gtest.h>

namespace tagwrench::link {
namespace {

TEST(Version, OfAnotherMajorSaysWhichSideToUpdate) {
  EXPECT_EQ(needed_update(1, 1), Update::none);
  EXPECT_EQ(needed_update(2, 1), Update::board);
  EXPECT_EQ(needed_update(1, 2), Update::host);
  EXPECT_EQ(needed_update(1, 0), Update::board);
  EXPECT_EQ(needed_update(1, 255), Update::host);
}

}  // namespace
}  // namespace tagwrench::link
