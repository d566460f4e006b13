#include <gtest/gtest.h>

#include <thread>

#include "host/web/server/live_feed.h"
#include "tests/unit/web/live_frames.h"

namespace tagwrench {
namespace {

using test::LoggedPicture;
using test::numbered_sample;

TEST(WebFeed, SamplesAreReadAtTheirPositions) {
  LiveFeed feed;
  Track track;
  track.residual_px = 0.03;
  track.tags_held = 2;
  feed.sample(numbered_sample(7), &track);
  feed.sample(numbered_sample(8), nullptr);
  EXPECT_EQ(feed.written(), 2U);
  const auto first = feed.read(0);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->sample.sequence, 7U);
  EXPECT_EQ(first->sample.wrench[5], 7);
  EXPECT_EQ(first->residual_px, 0.03);
  EXPECT_EQ(first->tags_held, 2);
  EXPECT_EQ(first->frames, 1U);
  const auto second = feed.read(1);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->tags_held, 0);
  EXPECT_EQ(second->frames, 1U);  // it was none
  EXPECT_FALSE(feed.read(2));
}

TEST(WebFeed, TheOldestAreOverwritten) {
  LiveFeed feed;
  for (std::uint64_t i = 0; i < LiveFeed::kKept + 10; ++i) feed.sample(numbered_sample(i), nullptr);
  EXPECT_FALSE(feed.read(9));
  ASSERT_TRUE(feed.read(10));
  EXPECT_EQ(feed.read(10)->sample.sequence, 10U);
}

TEST(WebFeed, LostFramesAreSummed) {
  LiveFeed feed;
  Sample sample = numbered_sample(1);
  sample.dropped = 3;
  feed.sample(sample, nullptr);
  feed.sample(sample, nullptr);
  EXPECT_EQ(feed.read(1)->dropped, 6U);
}

TEST(WebFeed, AReaderNeverSeesHalfASample) {
  constexpr std::uint64_t kSamples = 1'000'000;
  LiveFeed feed;
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < kSamples; ++i) feed.sample(numbered_sample(i), nullptr);
  });
  std::uint64_t torn = 0;
  std::uint64_t ahead = 0;
  for (std::uint64_t end = 0; end < kSamples; end = feed.written()) {
    if (end < LiveFeed::kKept) continue;
    const std::uint64_t position = end - LiveFeed::kKept + ahead++ % 4;  // is overwritten soon
    const auto live = feed.read(position);
    if (!live) continue;
    const auto value = static_cast<double>(position);
    const bool whole = (live->sample.wrench.array() == value).all() &&
                       (live->sample.deflection.array() == value).all() &&
                       live->sample.sequence == position;
    if (!whole) ++torn;
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(feed.read(kSamples - 1)->sample.sequence, kSamples - 1);
}

TEST(WebFeed, PicturesAreWantedNowAndThen) {
  LiveFeed feed;
  LoggedPicture picture(8, 6);
  const TimePoint now{std::chrono::seconds(100)};
  EXPECT_FALSE(feed.wants_picture(now));
  feed.picture(picture.logged());
  EXPECT_EQ(feed.take_picture(), nullptr);
  feed.want_pictures(std::chrono::milliseconds(100));
  EXPECT_TRUE(feed.wants_picture(now));
  picture.sample.output_time = now;
  feed.picture(picture.logged());
  EXPECT_FALSE(feed.wants_picture(now + std::chrono::milliseconds(99)));
  EXPECT_TRUE(feed.wants_picture(now + std::chrono::milliseconds(100)));
  feed.want_pictures(Duration::max());
  EXPECT_FALSE(feed.wants_picture(now + std::chrono::hours(1)));
}

TEST(WebFeed, TheReaderGetsTheNewestPictureAndKeepsIt) {
  LiveFeed feed;
  feed.want_pictures(Duration::zero());
  LoggedPicture picture(8, 6);
  const auto offer = [&](std::uint64_t sequence) {
    picture.frame.sequence = sequence;
    std::fill(picture.pixels().begin(), picture.pixels().end(),
              static_cast<std::uint8_t>(sequence));
    feed.picture(picture.logged());
  };
  offer(1);
  offer(2);
  const LivePicture* const taken = feed.take_picture();
  ASSERT_NE(taken, nullptr);
  EXPECT_EQ(taken->sequence, 2U);
  offer(3);  // into the other buffer
  offer(4);  // both are taken: it is left out
  EXPECT_EQ(taken->sequence, 2U);
  EXPECT_EQ(taken->bytes[0], 2);
  feed.release(taken);
  const LivePicture* const next = feed.take_picture();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->sequence, 3U);
  feed.release(next);
  EXPECT_EQ(feed.take_picture(), nullptr);
}

TEST(WebFeed, ARawPictureIsTakenAsItIsUnlessItIsTooLarge) {
  LiveFeed feed;
  feed.want_pictures(Duration::zero());
  LoggedPicture picture(8, 6);
  picture.frame.decoded = {2, 1, 3, 2};
  picture.pixels()[1 * 8 + 2] = 77;
  const std::vector<std::uint8_t> raw(96, 9);
  feed.picture(picture.logged({fourcc("YUYV"), raw, 16}));
  const LivePicture* taken = feed.take_picture();
  ASSERT_NE(taken, nullptr);
  EXPECT_EQ(taken->fourcc, fourcc("YUYV"));
  EXPECT_EQ(taken->size, 96U);
  EXPECT_TRUE(taken->part.empty());
  feed.release(taken);
  const std::vector<std::uint8_t> giant(LivePicture::kMaxBytes + 1);
  feed.picture(picture.logged({fourcc("YUYV"), giant, 16}));
  taken = feed.take_picture();
  ASSERT_NE(taken, nullptr);
  EXPECT_EQ(taken->part, (Region{2, 1, 3, 2}));
  EXPECT_EQ(taken->size, 6U);
  EXPECT_EQ(taken->bytes[0], 77);
}

}  // namespace
}  // namespace tagwrench
