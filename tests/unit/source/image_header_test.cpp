#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

#include "host/source/decode.h"
#include "tests/unit/source/jpeg_fixture.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

const Bytes kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n',  // signature
                    0,    0,   0,   13,  'I',  'H',  'D',  'R',   // chunk of 13 bytes
                    0,    0,   2,   128,                          // width 640
                    0,    0,   1,   224,                          // height 480
                    8,    0,   0,   0,   0};                      // 8-bit grey

const Bytes kJpeg = {0xFF, 0xD8,                          // start of image
                     0xFF, 0xE0, 0x00, 0x04, 0xAA, 0xBB,  // APP0, 4 bytes with its length
                     0xFF, 0xFF, 0xDB, 0x00, 0x03, 0x00,  // a fill byte, DQT
                     0xFF, 0xC0, 0x00, 0x0B, 0x08,        // SOF0, 8 bits
                     0x01, 0xE0, 0x02, 0x80,              // height 480, width 640
                     0x01, 0x01, 0x11, 0x00};             // one component

std::optional<ImageSize> size_of(std::string_view text) {
  return image_size({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(ImageHeader, ReadsPng) { EXPECT_EQ(image_size(kPng), (ImageSize{640, 480})); }

TEST(ImageHeader, ReadsJpegBehindOtherSegments) {
  EXPECT_EQ(image_size(kJpeg), (ImageSize{640, 480}));
  EXPECT_EQ(image_size(jpeg_of(pattern(96, 64), 96, 64)), (ImageSize{96, 64}));
}

TEST(ImageHeader, ReadsPgmWithComments) {
  EXPECT_EQ(size_of("P5\n640 480\n255\n"), (ImageSize{640, 480}));
  EXPECT_EQ(size_of("P2 # plain\n# made by hand\n 3\t2\n255\n0 0 0 0 0 0"), (ImageSize{3, 2}));
}

TEST(ImageHeader, RefusesWhatIsNone) {
  EXPECT_FALSE(size_of(""));
  EXPECT_FALSE(size_of("P5"));
  EXPECT_FALSE(size_of("P6\n640 480\n255\n"));
  EXPECT_FALSE(size_of("P5\n640 x\n255\n"));
  EXPECT_FALSE(size_of("P5\n0 480\n255\n"));
  EXPECT_FALSE(size_of("P5\n99999999999999999999 480\n255\n"));
  EXPECT_FALSE(size_of("P5\n640 48")) << "the number may go on";
  EXPECT_FALSE(size_of("GIF89a............................"));
}

TEST(ImageHeader, RefusesEveryTruncation) {
  for (std::size_t n = 0; n < kPng.size(); ++n) EXPECT_FALSE(image_size({kPng.data(), n})) << n;
  for (std::size_t n = 0; n < 23; ++n) EXPECT_FALSE(image_size({kJpeg.data(), n})) << n;
}

TEST(ImageHeader, SurvivesDamage) {
  std::mt19937 random(3);
  int sizes = 0;
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = round % 2 ? kJpeg : kPng;
    for (int i = 0; i < 3; ++i)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    bytes.resize(random() % (bytes.size() + 1));
    const auto size = image_size(bytes);
    if (!size) continue;
    ++sizes;
    ASSERT_GT(size->width, 0);
    ASSERT_LE(size->width, 16384);
    ASSERT_GT(size->height, 0);
    ASSERT_LE(size->height, 16384);
  }
  EXPECT_GT(sizes, 100);
}

}  // namespace
}  // namespace tagwrench
