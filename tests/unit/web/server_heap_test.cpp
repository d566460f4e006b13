// The frame loop's side of the live feed.
#include <gtest/gtest.h>

#include "tests/support/heap_count.h"
#include "tests/unit/web/live_frames.h"

namespace tagwrench {
namespace {

TEST(WebFeedHeap, SamplesAndPicturesUseNone) {
  LiveFeed feed;
  feed.want_pictures(Duration::zero());
  test::LoggedPicture picture(640, 480);
  test::start_counting_allocations();
  for (std::uint64_t i = 0; i < 1000; ++i) {
    feed.sample(test::numbered_sample(i), &picture.track);
    if (!feed.wants_picture(TimePoint{std::chrono::seconds(100)})) continue;
    feed.picture(picture.logged({fourcc("GREY"), picture.pixels(), 640}));
    feed.release(feed.take_picture());
  }
  EXPECT_EQ(test::stop_counting_allocations(), 0);
}

}  // namespace
}  // namespace tagwrench
