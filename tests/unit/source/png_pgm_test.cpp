#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>

#include "host/core/png/png.h"
#include "host/source/decode.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Random pixels of an OpenCV type, 23 x 17.
cv::Mat picture(int type) {
  cv::Mat picture(17, 23, type);
  cv::RNG random(5);
  random.fill(picture, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return picture;
}

Bytes encoded(const cv::Mat& picture, const char* kind) {
  Bytes bytes;
  cv::imencode(kind, picture, bytes);
  return bytes;
}

Bytes text(const std::string& text) { return {text.begin(), text.end()}; }

template <typename Level>
std::vector<Level> levels(const cv::Mat& picture) {
  return {picture.begin<Level>(), picture.end<Level>()};
}

TEST(Png, GreyComesBackAsItIs) {
  const cv::Mat grey = picture(CV_8UC1);
  std::vector<std::uint8_t> back;
  ASSERT_TRUE(decode_png(encoded(grey, ".png"), 23, 17, back));
  EXPECT_EQ(back, levels<std::uint8_t>(grey));
}

TEST(Png, SixteenBitsComeBackAsTheyAreOrAsTheirUpperEight) {
  const cv::Mat deep = picture(CV_16UC1);
  const Bytes file = encoded(deep, ".png");
  std::vector<std::uint16_t> counts;
  ASSERT_TRUE(decode_png(file, 23, 17, counts));
  EXPECT_EQ(counts, levels<std::uint16_t>(deep));
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(decode_png(file, 23, 17, grey));
  for (std::size_t i = 0; i < grey.size(); ++i) EXPECT_EQ(grey[i], counts[i] / 256) << i;
  EXPECT_FALSE(decode_png(encoded(picture(CV_8UC1), ".png"), 23, 17, counts));
  EXPECT_FALSE(decode_png(encoded(picture(CV_16UC3), ".png"), 23, 17, counts));
}

TEST(Png, WhatIsWrittenIsReadByOthersAsItWas) {
  const cv::Mat grey = picture(CV_8UC1);
  const cv::Mat deep = picture(CV_16UC1);
  const cv::Mat grey_back =
      cv::imdecode(encode_png(grey.ptr<std::uint8_t>(), 23, 17), cv::IMREAD_UNCHANGED);
  const cv::Mat deep_back =
      cv::imdecode(encode_png(deep.ptr<std::uint16_t>(), 23, 17), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(grey_back.type(), CV_8UC1);
  ASSERT_EQ(deep_back.type(), CV_16UC1);
  EXPECT_EQ(levels<std::uint8_t>(grey_back), levels<std::uint8_t>(grey));
  EXPECT_EQ(levels<std::uint16_t>(deep_back), levels<std::uint16_t>(deep));
  EXPECT_THROW(encode_png(grey.ptr<std::uint8_t>(), 0, 17), std::runtime_error);
}

TEST(Png, OfColoursTheLuminanceCounts) {
  for (const int type : {CV_8UC3, CV_8UC4, CV_16UC3}) {
    const Bytes file = encoded(picture(type), ".png");
    std::vector<std::uint8_t> grey;
    ASSERT_TRUE(decode_png(file, 23, 17, grey));
    const cv::Mat truth = cv::imdecode(file, cv::IMREAD_GRAYSCALE);
    for (std::size_t i = 0; i < grey.size(); ++i)
      EXPECT_NEAR(grey[i], levels<std::uint8_t>(truth)[i], 1) << "grey levels, pixel " << i;
  }
}

TEST(Png, HeaderTellsSizeAndKind) {
  const auto header = png_header(encoded(picture(CV_16UC3), ".png"));
  ASSERT_TRUE(header);
  EXPECT_EQ(header->width, 23U);
  EXPECT_EQ(header->height, 17U);
  EXPECT_EQ(header->bit_depth, 16);
  EXPECT_FALSE(header->grey);
  EXPECT_FALSE(png_header(text("P5 1 1 255\n")));
}

TEST(Png, IsNotDecodedIntoAnotherSize) {
  std::vector<std::uint8_t> grey;
  const Bytes file = encoded(picture(CV_8UC1), ".png");
  EXPECT_FALSE(decode_png(file, 17, 23, grey));
  EXPECT_FALSE(decode_png(file, 0, 0, grey));
}

// But for the checksum of the empty last chunk, 4 bytes.
TEST(Png, EveryTruncationAndEveryDamagedByteIsRefusedInSilence) {
  const Bytes file = encoded(picture(CV_8UC1), ".png");
  std::vector<std::uint8_t> grey;
  testing::internal::CaptureStderr();
  for (std::size_t n = 0; n + 4 < file.size(); ++n)
    EXPECT_FALSE(decode_png({file.data(), n}, 23, 17, grey)) << n;
  for (std::size_t n = 0; n + 4 < file.size(); ++n) {
    Bytes damaged = file;
    damaged[n] ^= 0x55;
    EXPECT_FALSE(decode_png(damaged, 23, 17, grey)) << n;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Pgm, BinaryComesBackAsItIs) {
  const cv::Mat grey = picture(CV_8UC1);
  std::vector<std::uint8_t> back;
  ASSERT_TRUE(decode_pgm(encoded(grey, ".pgm"), 23, 17, back));
  EXPECT_EQ(back, levels<std::uint8_t>(grey));
}

TEST(Pgm, PlainWithCommentsIsRead) {
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(decode_pgm(text("P2 # by hand\n3 # columns\n2\n255\n0 1 2\n# second row\n30 40 255"),
                         3, 2, grey));
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{0, 1, 2, 30, 40, 255}));
}

TEST(Pgm, WhiteIs255WhateverItsCount) {
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(decode_pgm(text("P2 3 1 15 0 7 15"), 3, 1, grey));
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{0, 119, 255}));
  Bytes deep = text("P5 3 1 4095\n");
  for (const int byte : {0x00, 0x00, 0x07, 0xFF, 0x0F, 0xFF})
    deep.push_back(static_cast<std::uint8_t>(byte));
  ASSERT_TRUE(decode_pgm(deep, 3, 1, grey));
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{0, 127, 255}));
}

TEST(Pgm, FirstPixelMayLookLikeWhiteSpace) {
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(decode_pgm(text("P5 2 1 255\n\n#"), 2, 1, grey));
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{'\n', '#'}));
}

TEST(Pgm, WhatIsDamagedIsRefusedInSilence) {
  testing::internal::CaptureStderr();
  std::vector<std::uint8_t> grey;
  const Bytes file = encoded(picture(CV_8UC1), ".pgm");
  for (std::size_t n = 0; n < file.size(); ++n)
    EXPECT_FALSE(decode_pgm({file.data(), n}, 23, 17, grey)) << n;
  for (const char* bad : {"P2 2 1 255 1", "P2 2 1 255 1 x", "P2 2 1 0 0 0", "P2 2 1 70000 1 2",
                          "P2 2 1 255 1 99999999999", "P2 1 2 255 1 2", "P5 2 1 300\nabc"})
    EXPECT_FALSE(decode_pgm(text(bad), 2, 1, grey)) << bad;
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace tagwrench
