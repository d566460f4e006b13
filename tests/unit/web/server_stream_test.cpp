#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/output/line_outputs.h"
#include "host/web/server/live_feed.h"
#include "tests/unit/web/live_frames.h"

namespace tagwrench {
namespace {

using nlohmann::json;
using test::numbered_sample;

json message_of(SampleStream& stream, std::uint64_t from) {
  const auto text = stream.message(from);
  return text ? json::parse(*text) : json();
}

TEST(WebStream, ASampleHasTheContractsKeysAndNumbers) {
  LiveSample live;
  live.sample = numbered_sample(3);
  live.sample.zero << 1, 2, 3, 4, 5, 6;
  live.sample.zero_state = ZeroState::following;
  live.sample.buttons = 5;
  live.residual_px = 0.0213;
  live.tags_held = 2;
  const json sample = json::parse(sample_text(live));
  LineBuffer buffer;
  const json contract = json::parse(json_line(buffer, live.sample));
  for (const auto& [key, value] : contract.items()) EXPECT_EQ(sample.at(key), value) << key;
  EXPECT_EQ(sample["zero"], (json{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(sample["zero_state"], "following");
  EXPECT_EQ(sample["motion"], (json{3, 3, 3, 3, 3, 3}));
  EXPECT_EQ(sample["buttons"], 5);
  EXPECT_EQ(sample["residual_px"], 0.0213);
  EXPECT_EQ(sample["tags_held"], 2);
}

TEST(WebStream, WhatIsNoNumberIsNeverSent) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  LiveSample live;
  live.sample = numbered_sample(3);
  live.sample.wrench[2] = kNone;
  live.sample.zero[1] = std::numeric_limits<double>::infinity();
  live.residual_px = kNone;
  const json sample = json::parse(sample_text(live));
  EXPECT_EQ(sample["status"], "doubtful");
  EXPECT_EQ(sample["motion"], (json{0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(sample["zero"][1], 0);
  EXPECT_EQ(sample["residual_px"], 0);
}

TEST(WebStream, APageGetsWhatItHasNotSeen) {
  LiveFeed feed;
  SampleStream stream(feed);
  for (std::uint64_t i = 0; i < 5; ++i) feed.sample(numbered_sample(i), nullptr);
  stream.pull();
  EXPECT_EQ(stream.end(), 5U);
  const json message = message_of(stream, 3);
  EXPECT_EQ(message["type"], "samples");
  EXPECT_EQ(message["lost"], 0);
  ASSERT_EQ(message["samples"].size(), 2U);
  EXPECT_EQ(message["samples"][0]["seq"], 3);
  EXPECT_EQ(message_of(stream, 5), json());
}

TEST(WebStream, ASlowPageLosesTheOldestAndIsTold) {
  LiveFeed feed;
  SampleStream stream(feed);
  for (std::uint64_t i = 0; i < 100; ++i) feed.sample(numbered_sample(i), nullptr);
  stream.pull();
  const json message = message_of(stream, 0);
  EXPECT_EQ(message["samples"].size(), SampleStream::kMax);
  EXPECT_EQ(message["lost"], 36);
  EXPECT_EQ(message["samples"].back()["seq"], 99);
}

TEST(WebStream, WhatTheReaderMissedCountsAsLostToo) {
  LiveFeed feed;
  SampleStream stream(feed);
  for (std::uint64_t i = 0; i < 3 * LiveFeed::kKept; ++i) feed.sample(numbered_sample(i), nullptr);
  stream.pull();
  EXPECT_EQ(message_of(stream, 0)["lost"], 3 * LiveFeed::kKept - SampleStream::kMax);
}

TEST(WebStream, PagesAtTheSamePlaceShareAMessage) {
  LiveFeed feed;
  SampleStream stream(feed);
  feed.sample(numbered_sample(0), nullptr);
  stream.pull();
  EXPECT_EQ(stream.message(0), stream.message(0));
  feed.sample(numbered_sample(1), nullptr);
  stream.pull();
  EXPECT_EQ(message_of(stream, 0)["samples"].size(), 2U);
}

TEST(WebStream, WhatCameWhileNobodyLookedIsForgotten) {
  LiveFeed feed;
  SampleStream stream(feed);
  for (std::uint64_t i = 0; i < 9; ++i) feed.sample(numbered_sample(i), nullptr);
  stream.skip();
  EXPECT_EQ(stream.end(), 9U);
  EXPECT_EQ(stream.message(0), nullptr);
}

TEST(WebFigures, RateLatencyAndJitterAreOfTheLastSecond) {
  LiveWindow window;
  const TimePoint start{std::chrono::seconds(100)};
  const auto at = [&](int i) {
    // 100 Hz, every other one half a millisecond late
    return start + std::chrono::milliseconds(10) * i +
           std::chrono::microseconds(i % 2 == 0 ? 0 : 500);
  };
  for (int i = 0; i < 300; ++i) window.add(at(i), i < 200 ? 99999 : 700 + i % 10);
  const LiveFigures figures = window.figures(at(299));
  EXPECT_NEAR(figures.rate_hz, 100, 0.1);
  EXPECT_NEAR(figures.latency_median_us, 705, 1);
  EXPECT_EQ(figures.latency_p99_us, 709);
  EXPECT_NEAR(figures.jitter_us, 500, 5);
}

TEST(WebFigures, AfterASecondOfSilenceThereAreNone) {
  LiveWindow window;
  const TimePoint start{std::chrono::seconds(100)};
  window.add(start, 700);
  EXPECT_EQ(window.figures(start).latency_median_us, 700);
  EXPECT_EQ(window.figures(start).rate_hz, 0);
  EXPECT_EQ(window.figures(start + std::chrono::milliseconds(1001)).latency_median_us, 0);
}

}  // namespace
}  // namespace tagwrench
