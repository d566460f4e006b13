#include <gtest/gtest.h>

#include <cmath>

#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {
namespace {

constexpr int kWidth = 100, kHeight = 96;

struct Picture {
  std::vector<std::uint8_t> pixels;
  explicit Picture(int level) : pixels(kWidth * kHeight, static_cast<std::uint8_t>(level)) {}
  void paint(int first_row, int last_row, int first_column, int last_column, int level) {
    for (int r = first_row; r < last_row; ++r) {
      for (int c = first_column; c < last_column; ++c)
        pixels[static_cast<std::size_t>(r * kWidth + c)] = static_cast<std::uint8_t>(level);
    }
  }
  ImageView view() const { return {pixels.data(), kWidth, kHeight, kWidth}; }
};

std::string verdict(const Picture& lit, const Picture& dark) {
  RowProfiler profiler(kWidth, kHeight);
  profiler.learn_lit(lit.view());
  profiler.learn_dark(dark.view());
  return profiler.choose();
}

TEST(RowProfiler, MeasuresTheMeanOfEachBandOfRows) {
  RowProfiler profiler(kWidth, kHeight);
  profiler.learn_lit(Picture(120).view());
  profiler.learn_dark(Picture(10).view());
  ASSERT_EQ(profiler.choose(), "");
  ASSERT_EQ(profiler.bands().size(), 48U);
  EXPECT_NEAR(profiler.ambient_fraction(), 10.0 / 120, 1e-9);
  Picture half(10);
  half.paint(48, 96, 0, kWidth, 120);
  half.paint(10, 11, 0, kWidth, 60);
  const RowProfile rows = profiler.measure(half.view());
  EXPECT_DOUBLE_EQ(rows[0], 10);
  EXPECT_DOUBLE_EQ(rows[5], 35) << "rows 10 and 11";
  EXPECT_DOUBLE_EQ(rows[47], 120);
}

TEST(RowProfiler, ABandLiesWhereItsLightIs) {
  RowProfiler profiler(kWidth, kHeight);
  Picture lit(120);
  lit.paint(0, 1, 0, kWidth, 41);  // the first row is lit less
  profiler.learn_lit(lit.view());
  profiler.learn_dark(Picture(10).view());
  ASSERT_EQ(profiler.choose(), "");
  const RowBand uneven = profiler.bands()[0], even = profiler.bands()[1];
  // Two rows: at 1/2 and 3/2, as far from their middle as their scatter says.
  EXPECT_NEAR(0.5 * (even.first + even.last) * kHeight, 3.0, 1e-9);
  EXPECT_NEAR((even.last - even.first) * kHeight, std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(0.5 * (uneven.first + uneven.last) * kHeight, (31 * 0.5 + 110 * 1.5) / 141, 1e-9);
}

TEST(RowProfiler, LeavesOutWhatIsWhiteOrNotLit) {
  Picture lit(120), dark(10);
  lit.paint(0, kHeight, 0, 20, 255);
  lit.paint(0, kHeight, 20, 30, 12);
  RowProfiler profiler(kWidth, kHeight);
  profiler.learn_lit(lit.view());
  profiler.learn_dark(dark.view());
  ASSERT_EQ(profiler.choose(), "");
  EXPECT_NEAR(profiler.saturated_fraction(), 0.2, 1e-9);
  EXPECT_NEAR(profiler.used_fraction(), 0.7, 1e-9);
  Picture garbage(50);
  garbage.paint(0, kHeight, 0, 30, 200);
  for (const double row : profiler.measure(garbage.view())) EXPECT_DOUBLE_EQ(row, 50);
}

TEST(RowProfiler, SaysWhyASceneTellsNothing) {
  EXPECT_NE(verdict(Picture(14), Picture(10)).find("LED does not show"), std::string::npos);
  EXPECT_NE(verdict(Picture(255), Picture(10)).find("white"), std::string::npos);
  EXPECT_NE(verdict(Picture(200), Picture(180)).find("not the LED's"), std::string::npos);
  RowProfiler none(kWidth, kHeight);
  EXPECT_NE(none.choose().find("no pictures"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench
