#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <nlohmann/json.hpp>

#include "host/web/server/live_feed.h"
#include "tests/unit/web/live_frames.h"

namespace tagwrench {
namespace {

using nlohmann::json;
using test::LoggedPicture;

struct ShownPicture {
  json header;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;
};

ShownPicture shown(const std::vector<std::uint8_t>& message) {
  ShownPicture out;
  const std::size_t size = message[0] | message[1] << 8 | message[2] << 16 | message[3] << 24;
  const auto jpeg = message.begin() + 4 + static_cast<std::ptrdiff_t>(size);
  out.header = json::parse(message.begin() + 4, jpeg);
  const auto bytes = static_cast<unsigned long>(message.end() - jpeg);
  tjhandle handle = tjInitDecompress();
  int sampling = 0;
  int space = 0;
  EXPECT_EQ(tjDecompressHeader3(handle, &*jpeg, bytes, &out.width, &out.height, &sampling, &space),
            0);
  out.grey.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  EXPECT_EQ(
      tjDecompress2(handle, &*jpeg, bytes, out.grey.data(), out.width, 0, out.height, TJPF_GRAY, 0),
      0);
  tjDestroy(handle);
  return out;
}

/// What pages get of a logged frame.
ShownPicture through_feed(const LoggedFrame& logged) {
  LiveFeed feed;
  PictureMaker maker;
  feed.want_pictures(Duration::zero());
  feed.picture(logged);
  const LivePicture* const picture = feed.take_picture();
  const auto whole = maker.decode(*picture);
  return shown(*maker.message(*picture, *whole));
}

/// Left half dark, right half bright.
void paint(LoggedPicture& picture) {
  const int width = picture.frame.image.width;
  for (std::size_t i = 0; i < picture.pixels().size(); ++i)
    picture.pixels()[i] = static_cast<int>(i) % width < width / 2 ? 50 : 200;
}

TEST(WebPicture, AGreyFrameIsShownAsItIs) {
  LoggedPicture picture(320, 240);
  paint(picture);
  picture.frame.sequence = 12;
  picture.track.corner_count = 1;
  picture.track.corners[0] = {5, {1, 2, 3, 4, 5, 6, 7, 8.04}};
  const ShownPicture out = through_feed(picture.logged({fourcc("GREY"), picture.pixels(), 320}));
  EXPECT_EQ(out.header["seq"], 12);
  EXPECT_EQ(out.header["width"], 320);
  EXPECT_EQ(out.header["height"], 240);
  EXPECT_EQ(out.header["status"], "ok");
  EXPECT_EQ(out.header["tags"][0]["id"], 5);
  EXPECT_EQ(out.header["tags"][0]["px"], (json{1, 2, 3, 4, 5, 6, 7, 8}));
  ASSERT_EQ(out.width, 320);
  ASSERT_EQ(out.height, 240);
  EXPECT_NEAR(out.grey[100 * 320 + 80], 50, 3);
  EXPECT_NEAR(out.grey[100 * 320 + 240], 200, 3);
}

TEST(WebPicture, AWideFrameIsMadeSmaller) {
  LoggedPicture picture(1280, 722);
  paint(picture);
  const ShownPicture out = through_feed(picture.logged({fourcc("GREY"), picture.pixels(), 1280}));
  EXPECT_EQ(out.header["width"], 1280);  // of what the tags' corners refer to
  EXPECT_EQ(out.width, 640);
  EXPECT_EQ(out.height, 361);
  EXPECT_NEAR(out.grey[360 * 640 + 160], 50, 3);
  EXPECT_NEAR(out.grey[360 * 640 + 480], 200, 3);
}

TEST(WebPicture, WhereOnlyAPartIsKnownTheRestIsGrey) {
  LoggedPicture picture(320, 240);
  paint(picture);
  picture.frame.decoded = {160, 120, 160, 120};
  const ShownPicture out = through_feed(picture.logged());
  ASSERT_EQ(out.width, 320);
  EXPECT_NEAR(out.grey[10 * 320 + 10], 128, 3);
  EXPECT_NEAR(out.grey[200 * 320 + 300], 200, 3);
}

TEST(WebPicture, ADamagedFrameIsNotShown) {
  LoggedPicture picture(320, 240);
  const std::vector<std::uint8_t> rubbish(1000, 0xd8);
  LiveFeed feed;
  PictureMaker maker;
  feed.want_pictures(Duration::zero());
  for (const std::uint32_t format : {fourcc("MJPG"), fourcc("YUYV"), fourcc("PNG "), 0U}) {
    feed.picture(picture.logged({format, rubbish, 0}));
    const LivePicture* const taken = feed.take_picture();
    EXPECT_FALSE(maker.decode(*taken)) << format;
    feed.release(taken);
  }
}

}  // namespace
}  // namespace tagwrench
