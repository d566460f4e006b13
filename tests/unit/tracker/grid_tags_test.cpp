// The table of grid_10x10 against the rule behind it, and its tags against each other.
#include "host/core/grid_tags.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bitset>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "host/tracker/acquire.h"
#include "host/tracker/target.h"

namespace tagwrench {
namespace {

constexpr int kCells = kGridCells * kGridCells;
constexpr int kWays = 8;  // four turns, each mirrored or not
using Bits = std::bitset<kCells>;

Bits in_table(int id) {
  Bits bits;
  for (int row = 0; row < kGridCells; ++row) {
    for (int column = 0; column < kGridCells; ++column) {
      bits[static_cast<std::size_t>(row * kGridCells + column)] = grid_is_white(id, row, column);
    }
  }
  return bits;
}

Bits turned(const Bits& bits, int way) {
  Bits out;
  for (int row = 0; row < kGridCells; ++row) {
    for (int column = 0; column < kGridCells; ++column) {
      int r = row, c = column;
      if (way >= 4) std::swap(r, c);
      for (int turn = 0; turn < way % 4; ++turn) {
        std::swap(r, c);
        c = kGridCells - 1 - c;
      }
      out[static_cast<std::size_t>(r * kGridCells + c)] =
          bits[static_cast<std::size_t>(row * kGridCells + column)];
    }
  }
  return out;
}

int distance(const Bits& a, const Bits& b) { return static_cast<int>((a ^ b).count()); }

/// The smallest distance to `earlier` in every way, and to itself in every way but as it is.
int nearest(const Bits& bits, const std::vector<Bits>& earlier) {
  int least = kCells;
  for (int way = 0; way < kWays; ++way) {
    const Bits other = turned(bits, way);
    if (way != 0) least = std::min(least, distance(bits, other));
    for (const Bits& e : earlier) least = std::min(least, distance(e, other));
  }
  return least;
}

TEST(GridTags, AnyTwoAndAnyTurnOrMirrorImageDifferInTwelveCells) {
  std::vector<Bits> earlier;
  int least = kCells;
  for (int id = 0; id < kGridIds; ++id) {
    least = std::min(least, nearest(in_table(id), earlier));
    earlier.push_back(in_table(id));
  }
  EXPECT_EQ(least, kGridDistance);
}

TEST(GridTags, TableFollowsFromItsRule) {
  constexpr int kFlips = 8;
  std::vector<Bits> table;
  std::uint32_t x = 1;
  for (int draw = 0; draw < 1000 && table.size() < kGridIds; ++draw) {
    Bits flipped;
    while (flipped.count() < kFlips) {
      x ^= x << 13;
      x ^= x >> 17;
      x ^= x << 5;
      flipped.set(x % kCells);
    }
    Bits bits;
    for (std::size_t i = 0; i < kCells; ++i) {
      bits[i] = (i / kGridCells + i % kGridCells) % 2 == 1;
    }
    bits ^= flipped;
    if (nearest(bits, table) >= kGridDistance) table.push_back(bits);
  }
  ASSERT_EQ(table.size(), static_cast<std::size_t>(kGridIds));
  for (int id = 0; id < kGridIds; ++id) {
    EXPECT_EQ(table[static_cast<std::size_t>(id)], in_table(id)) << "id " << id;
  }
}

TEST(GridTags, NearlyEveryCellEndsAtAnEdge) {
  // A full checkerboard has 180 edges inside of its 10 x 10 cells.
  for (int id = 0; id < kGridIds; ++id) {
    int edges = 0;
    for (int row = 0; row < kGridCells; ++row) {
      for (int column = 0; column < kGridCells; ++column) {
        const bool white = grid_is_white(id, row, column);
        if (column > 0) edges += white != grid_is_white(id, row, column - 1) ? 1 : 0;
        if (row > 0) edges += white != grid_is_white(id, row - 1, column) ? 1 : 0;
      }
    }
    EXPECT_GE(edges, 145) << "id " << id;
  }
}

TEST(GridTags, PatternIsTheTableInABlackFrame) {
  for (int id = 0; id < kGridIds; ++id) {
    const TagPattern pattern = tag_pattern(TagFamily::grid_10x10, id, 3.8e-3, 0.35e-3);
    ASSERT_EQ(pattern.cells, kGridCells + 2);
    for (int row = 0; row < pattern.cells; ++row) {
      for (int column = 0; column < pattern.cells; ++column) {
        const bool frame =
            row == 0 || column == 0 || row == kGridCells + 1 || column == kGridCells + 1;
        EXPECT_EQ(pattern.is_white(row, column), !frame && grid_is_white(id, row - 1, column - 1))
            << "id " << id << " row " << row << " column " << column;
      }
    }
  }
}

// A picture of tags (black frames included, `is_white` within), size_px wide and 0.7 as high, side
// by side and blurred, with noise of 2 grey levels.
template <typename IsWhite>
cv::Mat picture(int tags, const IsWhite& is_white, double blur_px, double size_px) {
  constexpr int kCell_px = 16;
  constexpr int kArt_px = kCell_px * (kGridCells + 2);
  cv::Mat image(480, 640, CV_32F, cv::Scalar(200));
  for (int tag = 0; tag < tags; ++tag) {
    cv::Mat art(kArt_px, kArt_px, CV_32F, cv::Scalar(30));
    for (int row = 0; row < kGridCells; ++row) {
      for (int column = 0; column < kGridCells; ++column) {
        if (!is_white(tag, row, column)) continue;
        art(cv::Rect((column + 1) * kCell_px, (row + 1) * kCell_px, kCell_px, kCell_px)) = 200;
      }
    }
    cv::resize(art, art, {static_cast<int>(size_px), static_cast<int>(0.7 * size_px)}, 0, 0,
               cv::INTER_AREA);
    art.copyTo(image(cv::Rect(100 + 220 * tag, 150, art.cols, art.rows)));
  }
  cv::GaussianBlur(image, image, {}, blur_px);
  cv::RNG random(7);
  cv::Mat noise(image.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0, 2);
  image += noise;
  cv::Mat grey;
  image.convertTo(grey, CV_8U);
  return grey;
}

Finding find(const cv::Mat& grey) {
  TargetDescription target;
  target.family = TagFamily::grid_10x10;
  target.tags = {Tag{0, {}, Vector6::Zero()}, Tag{1, {}, Vector6::Zero()}};
  return Acquirer(CameraModel{}, target)
      .find({grey.data, grey.cols, grey.rows, static_cast<int>(grey.step)});
}

TEST(GridTags, AreFoundOutOfFocusAndSmall) {
  struct Case {
    double blur_px, size_px;
  };
  for (const Case& c : {Case{1.0, 128}, Case{2.0, 128}, Case{2.0, 100}, Case{1.0, 64}}) {
    const Finding finding = find(picture(2, grid_is_white, c.blur_px, c.size_px));
    ASSERT_EQ(finding.tags.size(), 2u) << "blur " << c.blur_px << " px, size " << c.size_px;
    for (const FoundTag& tag : finding.tags) {
      const Eigen::Vector2d corner(99.5 + 220.0 * static_cast<double>(tag.index), 149.5);
      EXPECT_LT((tag.corners_px[0] - corner).norm(), 0.7)
          << "blur " << c.blur_px << " px, size " << c.size_px;
    }
  }
}

TEST(GridTags, PlainCheckerboardIsNone) {
  const auto checkerboard = [](int, int row, int column) { return (row + column) % 2 == 1; };
  for (const double blur_px : {1.0, 2.0}) {
    EXPECT_TRUE(find(picture(2, checkerboard, blur_px, 128)).tags.empty()) << blur_px;
  }
}

}  // namespace
}  // namespace tagwrench
