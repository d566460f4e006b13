// Decoding a part of the frame: the part is exactly what the whole frame has there, and nothing
// else is touched.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>

#include "host/source/decode.h"
#include "tests/unit/source/jpeg_kinds.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes copy_of(const ImageView& image) {
  Bytes out;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    out.insert(out.end(), row, row + image.width);
  }
  return out;
}

/// Inside, across and at the edges of an image of this size, one pixel, strips, all.
std::vector<Region> regions_of(int width, int height) {
  return {{},
          {0, 0, width, height},
          {width / 3, height / 4, width / 3, height / 2},
          {width / 3 + 1, height / 4 + 1, 1, 1},
          {0, 0, 1, 1},
          {width - 1, height - 1, 1, 1},
          {width - 9, 0, 9, height},
          {0, height - 7, width, 7},
          {0, height / 2, width, 5},
          {width / 2 - 3, 0, 17, height / 2},
          {width / 2, height / 2, width, height},
          {-20, -20, width, height}};
}

std::string text(const Region& r) {
  return std::to_string(r.x) + "," + std::to_string(r.y) + " " + std::to_string(r.width) + "x" +
         std::to_string(r.height);
}

/// The number of pixels in which `image` differs from `inside` in `region` and from `outside`
/// elsewhere.
int differences(const ImageView& image, const Region& region, const Bytes& inside,
                const Bytes& outside) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto at = static_cast<std::size_t>(y * image.width + x);
      const Bytes& truth = region.contains({x, y, 1, 1}) ? inside : outside;
      count += image.pixels[y * image.stride + x] != truth[at];
    }
  }
  return count;
}

Bytes inverted(Bytes pixels) {
  for (auto& value : pixels) value = static_cast<std::uint8_t>(255 - value);
  return pixels;
}

/// As libjpeg-turbo's simple interface decodes it, which knows nothing of regions.
Bytes by_turbojpeg(const Bytes& jpeg, int width, int height) {
  Bytes out(static_cast<std::size_t>(width * height));
  const tjhandle handle = tjInitDecompress();
  EXPECT_EQ(tjDecompress2(handle, jpeg.data(), jpeg.size(), out.data(), width, width, height,
                          TJPF_GRAY, 0),
            0)
      << tjGetErrorStr2(handle);
  tjDestroy(handle);
  return out;
}

constexpr std::array<std::pair<int, int>, 5> kSizes = {
    {{160, 120}, {161, 119}, {33, 17}, {17, 65}, {8, 8}}};

TEST(Region, IsClippedToTheImage) {
  EXPECT_EQ((Region{-5, 10, 20, 100}.clipped(64, 48)), (Region{0, 10, 15, 38}));
  EXPECT_EQ((Region{60, 40, 20, 20}.clipped(64, 48)), (Region{60, 40, 4, 8}));
  EXPECT_EQ((Region{1, 2, 3, 4}.clipped(64, 48)), (Region{1, 2, 3, 4}));
}

TEST(Region, EmptyOrOutsideMeansTheWholeImage) {
  const Region whole{0, 0, 64, 48};
  EXPECT_EQ(Region{}.clipped(64, 48), whole);
  EXPECT_EQ((Region{64, 0, 5, 5}.clipped(64, 48)), whole);
  EXPECT_EQ((Region{3, 3, -4, 5}.clipped(64, 48)), whole);
  EXPECT_EQ((Region{-9, -9, 9, 9}.clipped(64, 48)), whole);
}

TEST(Region, OfAbsurdNumbersIsClippedToo) {
  constexpr int kMax = std::numeric_limits<int>::max();
  constexpr int kMin = std::numeric_limits<int>::min();
  EXPECT_EQ((Region{5, 6, kMax, kMax}.clipped(64, 48)), (Region{5, 6, 59, 42}));
  EXPECT_EQ((Region{kMin, kMax, kMax, kMax}.clipped(64, 48)), (Region{0, 0, 64, 48}));
}

TEST(Region, ContainsWhatLiesWithinIt) {
  const Region region{10, 20, 30, 40};
  EXPECT_TRUE(region.contains(region));
  EXPECT_TRUE(region.contains({39, 59, 1, 1}));
  EXPECT_FALSE(region.contains({40, 59, 1, 1}));
  EXPECT_FALSE(region.contains({9, 20, 5, 5}));
}

TEST(DecodeRegion, GreyIsWholeAnyway) {
  const Bytes buffer = pattern(16, 8);
  Decoder decoder(PixelFormat::grey, 16, 8, 0);
  ImageView image;
  Region decoded;
  ASSERT_TRUE(decoder.decode(buffer, buffer.size(), {4, 2, 3, 3}, image, decoded));
  EXPECT_EQ(decoded, (Region{0, 0, 16, 8}));
}

TEST(DecodeRegion, OfYuyvAndUyvyIsExactAndTouchesNothingElse) {
  constexpr int kWidth = 62, kHeight = 40, kStride = 2 * kWidth + 6;
  const Bytes now = pattern(kWidth, kHeight), before = inverted(now);
  for (const PixelFormat format : {PixelFormat::yuyv, PixelFormat::uyvy}) {
    const auto packed = [&](const Bytes& luma) {
      Bytes out(static_cast<std::size_t>(kStride) * kHeight, 0xEE);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          out[static_cast<std::size_t>(y * kStride + 2 * x + (format == PixelFormat::uyvy))] =
              luma[static_cast<std::size_t>(y * kWidth + x)];
        }
      }
      return out;
    };
    const Bytes first = packed(before), second = packed(now);
    for (const Region& wanted : regions_of(kWidth, kHeight)) {
      Decoder decoder(format, kWidth, kHeight, kStride);
      ImageView image;
      Region decoded;
      ASSERT_TRUE(decoder.decode(first, first.size(), image));
      ASSERT_TRUE(decoder.decode(second, second.size(), wanted, image, decoded));
      EXPECT_EQ(decoded, wanted.clipped(kWidth, kHeight)) << text(wanted);
      EXPECT_EQ(differences(image, decoded, now, before), 0) << name(format) << text(wanted);
    }
  }
}

TEST(DecodeRegion, WholeJpegsOfEveryKindAreThoseOfTheSimpleInterface) {
  for (const auto& [width, height] : kSizes) {
    for (const JpegKind& kind : jpeg_kinds()) {
      const Bytes jpeg = jpeg_of_kind(kind, pattern(width, height), width, height);
      Decoder decoder(PixelFormat::mjpg, width, height, 0);
      ImageView image;
      ASSERT_TRUE(decoder.decode(jpeg, jpeg.size(), image)) << kind.name;
      EXPECT_EQ(copy_of(image), by_turbojpeg(jpeg, width, height)) << kind.name << " " << width;
    }
  }
}

TEST(DecodeRegion, OfEveryKindOfJpegIsThatOfTheWholeAndTouchesNothingElse) {
  constexpr int kMaxSurplusColumns = 31;
  for (const auto& [width, height] : kSizes) {
    const Bytes luma = pattern(width, height);
    for (const JpegKind& kind : jpeg_kinds()) {
      const Bytes first = jpeg_of_kind(kind, inverted(luma), width, height);
      const Bytes second = jpeg_of_kind(kind, luma, width, height);
      const Bytes before = by_turbojpeg(first, width, height);
      const Bytes now = by_turbojpeg(second, width, height);
      Decoder decoder(PixelFormat::mjpg, width, height, 0);
      for (const Region& wanted : regions_of(width, height)) {
        const std::string what = kind.name + " " + std::to_string(width) + ": " + text(wanted);
        const Region asked = wanted.clipped(width, height);
        ImageView image;
        Region decoded;
        ASSERT_TRUE(decoder.decode(first, first.size(), image)) << what;
        ASSERT_TRUE(decoder.decode(second, second.size(), wanted, image, decoded)) << what;
        EXPECT_TRUE(decoded.contains(asked)) << what << " got " << text(decoded);
        EXPECT_EQ(decoded.height, asked.height) << what;
        EXPECT_LE(decoded.width, asked.width + kMaxSurplusColumns) << what;
        EXPECT_EQ(differences(image, decoded, now, before), 0) << what;
      }
    }
  }
}

TEST(DecodeRegion, ACutOffJpegIsExactlyRightOrRefused) {
  constexpr int kWidth = 160, kHeight = 120;
  const Region wanted{40, 30, 60, 40};
  for (const JpegKind& kind : jpeg_kinds()) {
    const Bytes jpeg = jpeg_of_kind(kind, pattern(kWidth, kHeight), kWidth, kHeight);
    const Bytes truth = by_turbojpeg(jpeg, kWidth, kHeight);
    Decoder decoder(PixelFormat::mjpg, kWidth, kHeight, 0);
    int accepted = 0;
    for (std::size_t size = jpeg.size() - 3; size > 3; size -= std::min<std::size_t>(size, 37)) {
      const Bytes part(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(size));
      ImageView image;
      Region decoded;
      if (decoder.decode(part, part.size(), wanted, image, decoded)) {
        ++accepted;
        const Bytes pixels = copy_of(image);
        EXPECT_EQ(differences(image, decoded, truth, pixels), 0) << kind.name << " " << size;
        EXPECT_FALSE(decoder.decode(part, part.size(), {}, image, decoded)) << "the rest is gone";
        EXPECT_EQ(differences(image, decoded, truth, copy_of(image)), 0)
            << kind.name << ": trying to decode the rest spoilt the region";
      }
    }
    const bool in_order = !kind.progressive && !kind.one_scan_per_component;
    EXPECT_EQ(accepted > 0, in_order) << kind.name;
  }
}

TEST(DecodeRegion, DamagedJpegsNeverHarm) {
  constexpr int kWidth = 97, kHeight = 71;
  const Region wanted{30, 20, 40, 30};
  std::mt19937 random(21);
  const Bytes luma = pattern(kWidth, kHeight);
  for (const JpegKind& kind : jpeg_kinds()) {
    const Bytes jpeg = jpeg_of_kind(kind, luma, kWidth, kHeight);
    const Bytes truth = by_turbojpeg(jpeg, kWidth, kHeight);
    Decoder decoder(PixelFormat::mjpg, kWidth, kHeight, 0);
    ImageView image;
    Region decoded;
    int refused = 0;
    for (int round = 0; round < 300; ++round) {
      Bytes damaged = jpeg;
      if (random() % 4 == 0) damaged.resize(1 + random() % damaged.size());
      const int hits = 1 + static_cast<int>(random() % 8);
      for (int i = 0; i < hits; ++i) {
        // Half of the hits in the tables and headers.
        const std::size_t reach =
            random() % 2 ? damaged.size() : std::min<std::size_t>(damaged.size(), 640);
        damaged[random() % reach] = static_cast<std::uint8_t>(random());
      }
      if (decoder.decode(damaged, damaged.size(), wanted, image, decoded)) {
        ASSERT_TRUE(decoded.contains(wanted)) << kind.name;
        ASSERT_TRUE((Region{0, 0, kWidth, kHeight}.contains(decoded))) << kind.name;
      } else {
        ++refused;
      }
    }
    EXPECT_GT(refused, 50) << kind.name;
    ASSERT_TRUE(decoder.decode(jpeg, jpeg.size(), wanted, image, decoded)) << "it recovers";
    EXPECT_EQ(differences(image, decoded, truth, copy_of(image)), 0) << kind.name;
  }
}

TEST(DecodeRegion, DamageAboveTheRegionIsSeenByTheRestartMarkers) {
  const JpegKind kind{.name = "4:2:2 restart", .h = 2, .restart_in_mcus = 10};
  Bytes jpeg = jpeg_of_kind(kind, pattern(160, 120), 160, 120);
  const Bytes third_marker = {0xFF, 0xD2};
  const auto at =
      std::search(jpeg.begin() + 640, jpeg.end(), third_marker.begin(), third_marker.end());
  ASSERT_NE(at, jpeg.end());
  jpeg.erase(at - 40, at + 2);  // 40 bytes lost, with the marker of the third row of blocks
  Decoder decoder(PixelFormat::mjpg, 160, 120, 0);
  ImageView image;
  Region decoded;
  EXPECT_FALSE(decoder.decode(jpeg, jpeg.size(), {40, 60, 60, 40}, image, decoded));
}

TEST(DecodeRegion, WithRestartMarkersWhatLiesAboveIsNotEvenParsed) {
  constexpr int kWidth = 160, kHeight = 120;
  const Region wanted{40, 60, 60, 40};
  int kinds = 0;
  for (const JpegKind& kind : jpeg_kinds()) {
    if (kind.restart_in_rows != 1 || kind.arithmetic || kind.one_scan_per_component) continue;
    if (kind.components == 1 && kind.v > 1) continue;
    ++kinds;
    Bytes jpeg = jpeg_of_kind(kind, pattern(kWidth, kHeight), kWidth, kHeight);
    const Bytes truth = by_turbojpeg(jpeg, kWidth, kHeight);
    const Bytes first_marker = {0xFF, 0xD0}, second_marker = {0xFF, 0xD1};
    const auto from =
        std::search(jpeg.begin(), jpeg.end(), first_marker.begin(), first_marker.end());
    const auto to = std::search(from, jpeg.end(), second_marker.begin(), second_marker.end());
    ASSERT_NE(to, jpeg.end()) << kind.name;
    std::fill(from + 2, to, std::uint8_t{0x5A});  // the second row of blocks
    Decoder decoder(PixelFormat::mjpg, kWidth, kHeight, 0);
    ImageView image;
    Region decoded;
    ASSERT_TRUE(decoder.decode(jpeg, jpeg.size(), wanted, image, decoded)) << kind.name;
    EXPECT_EQ(differences(image, decoded, truth, copy_of(image)), 0) << kind.name;
    EXPECT_FALSE(decoder.decode(jpeg, jpeg.size(), image)) << kind.name << ": the whole is damaged";
  }
  EXPECT_EQ(kinds, 2);
}

TEST(DecodeRegion, ARestartMarkerOfAWrongNumberIsSeen) {
  const JpegKind kind{.name = "4:2:0 restart every row", .h = 2, .v = 2, .restart_in_rows = 1};
  const Bytes good = jpeg_of_kind(kind, pattern(160, 120), 160, 120);
  const Region wanted{40, 60, 60, 40};  // in rows of blocks 3 to 6
  Decoder decoder(PixelFormat::mjpg, 160, 120, 0);
  ImageView image;
  Region decoded;
  ASSERT_TRUE(decoder.decode(good, good.size(), wanted, image, decoded));
  const Bytes fourth_marker = {0xFF, 0xD3};
  const auto at = std::search(good.begin(), good.end(), fourth_marker.begin(), fourth_marker.end());
  ASSERT_NE(at, good.end());
  for (int wrong = 0; wrong < 8; ++wrong) {
    if (wrong == 3) continue;
    Bytes jpeg = good;
    jpeg[static_cast<std::size_t>(at - good.begin()) + 1] = static_cast<std::uint8_t>(0xD0 + wrong);
    EXPECT_FALSE(decoder.decode(jpeg, jpeg.size(), wanted, image, decoded)) << wrong;
  }
}

TEST(RestartMarkers, AreCountedOverStuffedAndFillBytes) {
  const Bytes data = {1, 0xFF, 0x00, 2, 0xFF, 0xD0, 3, 0xFF, 0xFF, 0xFF, 0xD1, 4};
  EXPECT_EQ(after_restart_markers(data, 0), 0U);
  EXPECT_EQ(after_restart_markers(data, 1), 6U);
  EXPECT_EQ(after_restart_markers(data, 2), 11U);
  EXPECT_EQ(after_restart_markers(data, 3), std::nullopt) << "the data ends before";
}

TEST(RestartMarkers, CountToSevenAndBeginAgain) {
  Bytes data;
  for (int i = 0; i < 20; ++i) {
    data.insert(data.end(), {7, 0xFF, static_cast<std::uint8_t>(0xD0 + i % 8)});
  }
  EXPECT_EQ(after_restart_markers(data, 20), data.size());
  data[3 * 9 + 2] = 0xD2;  // should be RST1
  EXPECT_EQ(after_restart_markers(data, 9), 27U);
  EXPECT_EQ(after_restart_markers(data, 10), std::nullopt);
}

TEST(RestartMarkers, AreNotLookedForBeyondAnotherMarkerOrTheEnd) {
  EXPECT_EQ(after_restart_markers(Bytes{1, 0xFF, 0xD9, 0xFF, 0xD0}, 1), std::nullopt);
  EXPECT_EQ(after_restart_markers(Bytes{1, 0xFF}, 1), std::nullopt);
  EXPECT_EQ(after_restart_markers(Bytes{1, 0xFF, 0xFF}, 1), std::nullopt);
  EXPECT_EQ(after_restart_markers({}, 1), std::nullopt);
}

TEST(DecodeRegion, LuminanceThatIsCoarserThanChrominanceIsRefused) {
  JpegKind kind{.name = "turned about"};
  kind.chroma_h = 2;
  const Bytes jpeg = jpeg_of_kind(kind, pattern(64, 48), 64, 48);
  Decoder decoder(PixelFormat::mjpg, 64, 48, 0);
  ImageView image;
  EXPECT_FALSE(decoder.decode(jpeg, jpeg.size(), image));
  const Bytes good = jpeg_of(pattern(64, 48), 64, 48);
  EXPECT_TRUE(decoder.decode(good, good.size(), image));
}

TEST(DecodeRegion, AJpegThatRepeatsItsScansWithoutEndIsRefused) {
  const JpegKind kind{.name = "scans", .one_scan_per_component = true};
  const Bytes jpeg = jpeg_of_kind(kind, pattern(32, 24), 32, 24);
  const Bytes start_of_scan = {0xFF, 0xDA};
  const auto last =
      std::find_end(jpeg.begin(), jpeg.end(), start_of_scan.begin(), start_of_scan.end());
  const auto with_scans = [&](int repetitions) {
    Bytes out(jpeg.begin(), last);
    for (int i = 0; i < repetitions; ++i) out.insert(out.end(), last, jpeg.end() - 2);
    out.insert(out.end(), jpeg.end() - 2, jpeg.end());
    return out;
  };
  Decoder decoder(PixelFormat::mjpg, 32, 24, 0);
  ImageView image;
  const Bytes some = with_scans(400), many = with_scans(600);
  EXPECT_TRUE(decoder.decode(some, some.size(), image));
  EXPECT_FALSE(decoder.decode(many, many.size(), image));
}

}  // namespace
}  // namespace tagwrench
