#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/source/simulator/prints.h"
#include "host/source/simulator/renderer.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench::sim {
namespace {

Scenario resting() {
  Scenario s;
  s.trajectory.motion = Motion::rest;
  return s;
}

std::vector<std::uint8_t> nth_frame(const Scenario& s, int n) {
  SimulatorSource source(s, false);
  Frame frame;
  for (int i = 0; i <= n; ++i) source.read(frame);
  return {frame.image.pixels, frame.image.pixels + frame.image.width * frame.image.height};
}

TEST(RenderImage, SameSeedSameBytesOtherSeedOtherBytes) {
  Scenario s;
  EXPECT_EQ(nth_frame(s, 2), nth_frame(s, 2));
  Scenario other = s;
  other.seed = 2;
  EXPECT_NE(nth_frame(s, 2), nth_frame(other, 2));
}

TEST(RenderImage, NoiseDiffersFromFrameToFrame) {
  SimulatorSource source(resting(), false);
  Frame frame;
  source.read(frame);
  const std::vector<std::uint8_t> first(frame.image.pixels, frame.image.pixels + 640 * 480);
  source.read(frame);
  int different = 0;
  for (int i = 0; i < 640 * 480; ++i)
    different += frame.image.pixels[i] != first[static_cast<std::size_t>(i)] ? 1 : 0;
  EXPECT_GT(different, 640 * 480 / 2);
}

TEST(RenderImage, NoiseVarianceIsReadPlusShot) {
  Scenario s = resting();
  s.noise = {1.2, 0.03};
  SimulatorSource source(s, false);
  constexpr int kFrames = 60;
  std::vector<double> sum(640 * 480), squares(640 * 480);
  for (int n = 0; n < kFrames; ++n) {
    Frame frame;
    source.read(frame);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += frame.image.pixels[i];
      squares[i] += frame.image.pixels[i] * static_cast<double>(frame.image.pixels[i]);
    }
  }
  // Pooled over pixels of like brightness; rounding to whole levels adds 1/12.
  for (const double level : {35.0, 80.0, 180.0}) {
    double pooled = 0, mean_level = 0;
    int count = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double mean = sum[i] / kFrames;
      if (std::abs(mean - level) > 5) continue;
      pooled += (squares[i] - kFrames * mean * mean) / (kFrames - 1);
      mean_level += mean;
      ++count;
    }
    ASSERT_GT(count, 500);
    const double expected = 1.2 * 1.2 + 0.03 * mean_level / count + 1.0 / 12;
    constexpr double kRelativeTolerance = 0.04;
    EXPECT_NEAR(pooled / count, expected, kRelativeTolerance * expected) << "level " << level;
  }
}

TEST(RenderImage, MirroredOutputIsTheFlippedImage) {
  Scenario s;
  const auto plain = nth_frame(s, 1);
  s.camera.mirrored = true;
  const auto mirrored = nth_frame(s, 1);
  for (std::size_t row = 0; row < 480; ++row) {
    std::vector<std::uint8_t> line(plain.begin() + static_cast<long>(row * 640),
                                   plain.begin() + static_cast<long>(row * 640 + 640));
    std::reverse(line.begin(), line.end());
    ASSERT_TRUE(
        std::equal(line.begin(), line.end(), mirrored.begin() + static_cast<long>(row * 640)))
        << "row " << row;
  }
}

TEST(RenderImage, ContrastIsThatOfAPhotograph) {
  const auto pixels = nth_frame(resting(), 0);
  const auto in_tags = [&](double share) {
    std::vector<std::uint8_t> levels;
    for (int row = 140; row < 340; ++row)
      levels.insert(levels.end(), &pixels[static_cast<std::size_t>(row * 640 + 255)],
                    &pixels[static_cast<std::size_t>(row * 640 + 385)]);
    const auto at = levels.begin() + static_cast<long>(share * static_cast<double>(levels.size()));
    std::nth_element(levels.begin(), at, levels.end());
    return static_cast<int>(*at);
  };
  EXPECT_GT(in_tags(0.02), 15);  // ink is not black
  EXPECT_LT(in_tags(0.4), 50);
  EXPECT_GT(in_tags(0.97), 120);
  EXPECT_LT(in_tags(0.999), 250);  // paper is not blown out
  EXPECT_EQ(*std::max_element(pixels.begin(), pixels.begin() + 640 * 160), 255);  // the corner is
}

TEST(RenderImage, DefocusSoftensEdges) {
  const auto steepest = [](double focus_m) {
    Scenario s = resting();
    s.noise = {0, 0};
    s.optics.focus_distance = focus_m;
    const auto pixels = nth_frame(s, 0);
    int most = 0;
    for (int row = 120; row < 350; ++row) {
      for (int column = 240; column < 400; ++column) {
        const std::size_t i = static_cast<std::size_t>(row * 640 + column);
        most = std::max(most, std::abs(pixels[i + 1] - pixels[i]));
      }
    }
    return most;
  };
  EXPECT_GT(steepest(20e-3), 1.5 * steepest(14e-3));
}

// Of a picture that was blurred before it was sampled, the pixels tell what lies half-way between
// them.
TEST(RenderImage, ATagHalfAPixelFurtherIsWhatInterpolationSays) {
  Scenario s = resting();
  s.noise = {0, 0};
  s.exposure.even = true;
  s.target.tags = {{5, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}};
  const TrajectoryPlayer player(s.trajectory, s.seed);
  PlatformMotion motion(s.mechanics, player, -0.1, 0.01);
  Renderer renderer(s);
  const auto shifted_px = [&](double shift) {
    Vector6 displacement = Vector6::Zero();
    displacement[0] = shift * s.target.rest_position.z() / s.camera.fx_px;
    motion.set_state({displacement, Vector6::Zero()});
    std::vector<std::uint8_t> pixels(640 * 480);
    renderer.render(motion, 0, 0, pixels.data());
    return pixels;
  };
  const auto here = shifted_px(0);
  const auto there = shifted_px(0.5);
  // Lagrange's polynomial through eight pixels, in their middle.
  constexpr double kWeights[4] = {1225 / 2048.0, -245 / 2048.0, 49 / 2048.0, -5 / 2048.0};
  double squares = 0;
  constexpr int kRows = 90;
  constexpr int kColumns = 140;
  for (int column = 320 - kColumns / 2; column < 320 + kColumns / 2; ++column) {
    double mean = 0;  // down the columns, along which edges run: rounding averages out
    for (int row = 240 - kRows / 2; row < 240 + kRows / 2; ++row) {
      const auto at = static_cast<std::size_t>(row * 640 + column);
      mean += there[at];
      for (std::size_t k = 0; k < 4; ++k) mean -= kWeights[k] * (here[at - 1 - k] + here[at + k]);
    }
    squares += std::pow(mean / kRows, 2);
  }
  EXPECT_LT(std::sqrt(squares / kColumns), 0.085);  // grey levels
}

TEST(RenderImage, JpegChangesLittleAndIsDeterministic) {
  Scenario s = resting();
  s.noise = {0, 0};
  const auto plain = nth_frame(s, 0);
  s.compression.jpeg_quality = 85;
  const auto jpeg = nth_frame(s, 0);
  EXPECT_EQ(jpeg, nth_frame(s, 0));
  double squares = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) squares += std::pow(plain[i] - jpeg[i], 2);
  const double rms_counts = std::sqrt(squares / static_cast<double>(plain.size()));
  EXPECT_GT(rms_counts, 0.1);
  EXPECT_LT(rms_counts, 4.0);
}

TEST(TagPrint, CellsOfTheTwoSeedTagsAsPrinted) {
  // ArUco-original words: 10000 = 0, 10111 = 1, 01001 = 2, 01110 = 3 (Garrido-Jurado et al. 2014);
  // id 5 = 0b0000000101, two bits a row from the top: 0 0 0 1 1.
  const TagCells five = tag_cells("aruco_original", 5);
  ASSERT_EQ(five.across, 7);
  const char* expected[7] = {"BBBBBBB", "BwBBBBB", "BwBBBBB", "BwBBBBB",
                             "BwBwwwB", "BwBwwwB", "BBBBBBB"};
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 7; ++column) {
      EXPECT_EQ(five.is_black(column, row), expected[row][column] == 'B')
          << "row " << row << " column " << column;
    }
  }
}

TEST(TagPrint, AllFamiliesOfTheContractExist) {
  for (const char* size : {"4x4", "5x5", "6x6", "7x7"}) {
    for (const int count : {50, 100, 250, 1000}) {
      EXPECT_EQ(family_size(std::string("aruco_") + size + "_" + std::to_string(count)), count);
    }
  }
  EXPECT_EQ(family_size("aruco_original"), 1024);
  EXPECT_EQ(family_size("apriltag_16h5"), 30);
  EXPECT_EQ(family_size("apriltag_25h9"), 35);
  EXPECT_EQ(family_size("apriltag_36h10"), 2320);
  EXPECT_EQ(family_size("apriltag_36h11"), 587);
  EXPECT_FALSE(family_exists("aruco_8x8_50"));
}

}  // namespace
}  // namespace tagwrench::sim
