#include "host/source/decode.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/source/jpeg_fixture.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<int> pixels(const ImageView& image) {
  std::vector<int> out;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) out.push_back(image.pixels[y * image.stride + x]);
  }
  return out;
}

double mean_error(const ImageView& image, const Bytes& truth) {
  double sum = 0;
  std::size_t i = 0;
  for (const int value : pixels(image)) sum += std::abs(value - truth[i++]);
  return sum / static_cast<double>(truth.size());
}

TEST(Decode, GreyIsAViewIntoTheBufferWithItsPadding) {
  const Bytes buffer = {1, 2, 0xEE, 0xEE,   // row 0, then 2 bytes of padding
                        3, 4, 0xEE, 0xEE};  // row 1
  Decoder decoder(PixelFormat::grey, 2, 2, 4);
  ImageView image;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), image));
  EXPECT_EQ(image.pixels, buffer.data());
  EXPECT_TRUE(decoder.borrows());
  EXPECT_EQ(pixels(image), (std::vector<int>{1, 2, 3, 4}));
}

TEST(Decode, Nv12TakesTheFirstPlane) {
  const Bytes buffer = {10,   20,     // Y, row 0
                        30,   40,     // Y, row 1
                        0x80, 0x81};  // U V for the four pixels
  Decoder decoder(PixelFormat::nv12, 2, 2, 0);
  ImageView image;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), image));
  EXPECT_EQ(image.pixels, buffer.data());
  EXPECT_EQ(pixels(image), (std::vector<int>{10, 20, 30, 40}));
}

TEST(Decode, YuyvTakesTheEvenBytesAndCopies) {
  const Bytes buffer = {10, 0x80, 20, 0x81, 0xEE, 0xEE,   // Y0 U Y1 V, padding
                        30, 0x82, 40, 0x83, 0xEE, 0xEE};  // row 1
  Decoder decoder(PixelFormat::yuyv, 2, 2, 6);
  ImageView image;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), image));
  EXPECT_FALSE(decoder.borrows());
  EXPECT_EQ(pixels(image), (std::vector<int>{10, 20, 30, 40}));
}

TEST(Decode, UyvyTakesTheOddBytes) {
  const Bytes buffer = {0x80, 10, 0x81, 20,   // U Y0 V Y1
                        0x82, 30, 0x83, 40};  // row 1
  Decoder decoder(PixelFormat::uyvy, 2, 2, 0);
  ImageView image;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), image));
  EXPECT_EQ(pixels(image), (std::vector<int>{10, 20, 30, 40}));
}

TEST(Decode, AStrideSmallerThanARowMeansPackedRows) {
  const Bytes buffer = {1, 2, 3, 4};
  Decoder decoder(PixelFormat::grey, 2, 2, 1);
  ImageView image;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), image));
  EXPECT_EQ(pixels(image), (std::vector<int>{1, 2, 3, 4}));
}

TEST(Decode, UncompressedFramesOneByteShortAreRefused) {
  const struct {
    PixelFormat format;
    std::size_t needed;
  } cases[] = {{PixelFormat::grey, 8 * 4},
               {PixelFormat::nv12, 8 * 4},
               {PixelFormat::yuyv, 2 * 8 * 4},
               {PixelFormat::uyvy, 2 * 8 * 4}};
  for (const auto& c : cases) {
    const Bytes buffer(c.needed, 7);
    Decoder decoder(c.format, 8, 4, 0);
    ImageView image;
    EXPECT_TRUE(decoder.decode(buffer, c.needed, image)) << name(c.format);
    EXPECT_FALSE(decoder.decode(buffer, c.needed - 1, image)) << name(c.format);
    EXPECT_FALSE(decoder.decode(buffer, 0, image)) << name(c.format);
    EXPECT_FALSE(decoder.decode(buffer, c.needed + 1, image)) << "more used than the buffer holds";
  }
}

TEST(Decode, TheLastRowNeedsNoPadding) {
  const Bytes buffer = {1, 2, 0xEE, 0xEE, 3, 4};
  Decoder decoder(PixelFormat::grey, 2, 2, 4);
  ImageView image;
  EXPECT_TRUE(decoder.decode(buffer, buffer.size(), image));
}

TEST(Decode, JpegGivesItsLuminance) {
  const Bytes truth = pattern(96, 64);
  const Bytes jpeg = jpeg_of(truth, 96, 64);
  Decoder decoder(PixelFormat::mjpg, 96, 64, 0);
  ImageView image;
  ASSERT_TRUE(decoder.decode(jpeg, jpeg.size(), image));
  constexpr double kTolerance_levels = 3;
  EXPECT_LT(mean_error(image, truth), kTolerance_levels);
}

TEST(Decode, JpegWithoutHuffmanTablesUsesTheStandardOnes) {
  const Bytes truth = pattern(96, 64);
  const Bytes jpeg = jpeg_of(truth, 96, 64);
  const Bytes bare = without_huffman_tables(jpeg);
  ASSERT_LT(bare.size() + 400, jpeg.size());
  Decoder decoder(PixelFormat::mjpg, 96, 64, 0);
  ImageView image;
  ASSERT_TRUE(decoder.decode(bare, bare.size(), image));
  constexpr double kTolerance_levels = 3;
  EXPECT_LT(mean_error(image, truth), kTolerance_levels);
}

TEST(Decode, PaddingAfterAWholeJpegIsAccepted) {
  Bytes jpeg = jpeg_of(pattern(96, 64), 96, 64);
  Decoder decoder(PixelFormat::mjpg, 96, 64, 0);
  ImageView image;
  Bytes before_end = jpeg;
  before_end.insert(before_end.end() - 2, 8, 0);  // between the data and the end marker FF D9
  EXPECT_TRUE(decoder.decode(before_end, before_end.size(), image));
  jpeg.insert(jpeg.end(), 500, 0);
  EXPECT_TRUE(decoder.decode(jpeg, jpeg.size(), image));
}

TEST(Decode, JpegOfAnotherSizeIsSkipped) {
  const Bytes jpeg = jpeg_of(pattern(96, 64), 96, 64);
  ImageView image;
  EXPECT_FALSE(Decoder(PixelFormat::mjpg, 96, 48, 0).decode(jpeg, jpeg.size(), image));
  EXPECT_FALSE(Decoder(PixelFormat::mjpg, 640, 480, 0).decode(jpeg, jpeg.size(), image));
  EXPECT_EQ(image.pixels, nullptr);
}

TEST(Decode, TruncatedJpegIsSkippedAtEveryLength) {
  const Bytes jpeg = jpeg_of(pattern(320, 240), 320, 240);
  Decoder decoder(PixelFormat::mjpg, 320, 240, 0);
  int tried = 0;
  for (std::size_t size = 0; size < jpeg.size(); size += 97, ++tried) {
    const Bytes part(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(size));
    ImageView image;
    EXPECT_FALSE(decoder.decode(part, part.size(), image)) << size << " of " << jpeg.size();
  }
  EXPECT_GT(tried, 100);
  ImageView image;
  EXPECT_TRUE(decoder.decode(jpeg, jpeg.size(), image)) << "the decoder recovers";
}

TEST(Decode, DamagedJpegNeverHarms) {
  const Bytes truth = pattern(160, 120);
  const Bytes jpeg = jpeg_of(truth, 160, 120);
  Decoder decoder(PixelFormat::mjpg, 160, 120, 0);
  std::mt19937 random(20);
  int refused = 0;
  for (int round = 0; round < 1500; ++round) {
    Bytes damaged = jpeg;
    const int hits = 1 + static_cast<int>(random() % 20);
    for (int i = 0; i < hits; ++i) {
      // Half of the hits in the tables and headers.
      const std::size_t reach = random() % 2 ? damaged.size() : 640;
      damaged[random() % reach] = static_cast<std::uint8_t>(random());
    }
    ImageView image;
    if (decoder.decode(damaged, damaged.size(), image)) {
      ASSERT_EQ(image.width, 160);
      ASSERT_EQ(image.height, 120);
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
  ImageView image;
  ASSERT_TRUE(decoder.decode(jpeg, jpeg.size(), image));
}

TEST(Decode, FormatsHaveTheirV4l2Codes) {
  // V4L2 packs the characters from the lowest byte up.
  EXPECT_EQ(pixel_format(std::uint32_t{0x56595559}), PixelFormat::yuyv);  // 'Y' 'U' 'Y' 'V'
  EXPECT_EQ(pixel_format(std::uint32_t{0x47504A4D}), PixelFormat::mjpg);  // 'M' 'J' 'P' 'G'
  EXPECT_EQ(pixel_format(std::uint32_t{0x4745504A}), PixelFormat::mjpg);  // 'J' 'P' 'E' 'G'
  EXPECT_EQ(pixel_format(std::uint32_t{0x20363159}), std::nullopt);       // 'Y' '1' '6' ' '
  EXPECT_EQ(pixel_format("grey"), PixelFormat::grey);
  EXPECT_EQ(pixel_format("H264"), std::nullopt);
  EXPECT_EQ(pixel_format("GRE"), std::nullopt);
}

}  // namespace
}  // namespace tagwrench
