// Stands for the tests of the emulated board where they cannot be built.
#include <gtest/gtest.h>

TEST(EmulatedBoard, IsThere) { GTEST_SKIP() << TAGWRENCH_ABSENT; }
