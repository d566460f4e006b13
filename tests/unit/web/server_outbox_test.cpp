#include <gtest/gtest.h>

#include "host/web/server/page_hub.h"
#include "host/web/server/static_site.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::shared_ptr<const std::string> shared(const std::string& text) {
  return std::make_shared<const std::string>(text);
}

std::string taken(Outbox& box) {
  const auto text = box.next_text();
  return text ? *text : "nothing";
}

TEST(WebOutbox, TheLatestOfATypeTakesThePlaceOfTheOneThatWaits) {
  Outbox box;
  box.replace("state", shared("state 1"));
  box.replace("job", shared("job 1"));
  box.replace("state", shared("state 2"));
  EXPECT_EQ(taken(box), "state 2");
  EXPECT_EQ(taken(box), "job 1");
  EXPECT_EQ(taken(box), "nothing");
}

TEST(WebOutbox, WhatIsKeptGoesFirstAndInOrder) {
  Outbox box;
  box.replace("state", shared("state"));
  box.keep(shared("answer 1"));
  box.keep(shared("answer 2"));
  EXPECT_EQ(taken(box), "answer 1");
  EXPECT_EQ(taken(box), "answer 2");
  EXPECT_EQ(taken(box), "state");
}

TEST(WebOutbox, NoMoreThan64AreKept) {
  Outbox box;
  for (std::size_t i = 0; i < Outbox::kMaxKept; ++i) EXPECT_TRUE(box.keep(shared("x")));
  EXPECT_FALSE(box.keep(shared("x")));
  taken(box);
  EXPECT_TRUE(box.keep(shared("x")));
}

TEST(WebOutbox, TypesAreBoundedToo) {
  Outbox box;
  for (int i = 0; i < 1000; ++i) box.replace("type " + std::to_string(i), shared("x"));
  std::size_t count = 0;
  while (box.next_text()) ++count;
  EXPECT_EQ(count, Outbox::kMaxTypes);
}

TEST(WebOutbox, OnlyTheNewestPictureWaits) {
  Outbox box;
  const auto first = std::make_shared<const std::vector<std::uint8_t>>(3);
  const auto second = std::make_shared<const std::vector<std::uint8_t>>(4);
  box.replace_picture(first);
  box.replace_picture(second);
  EXPECT_EQ(first.use_count(), 1);
  EXPECT_EQ(box.next_picture(), second);
  EXPECT_EQ(box.next_picture(), nullptr);
}

TEST(WebRate, ASecondHasSoManyWhereverItBegins) {
  MessageRate<3> rate;
  const TimePoint start{seconds(100)};
  EXPECT_TRUE(rate.count(start));
  EXPECT_TRUE(rate.count(start + milliseconds(900)));
  EXPECT_TRUE(rate.count(start + milliseconds(950)));
  EXPECT_TRUE(rate.count(start + milliseconds(1000)));   // the first is a second ago
  EXPECT_FALSE(rate.count(start + milliseconds(1100)));  // 900, 950, 1000, 1100
  EXPECT_TRUE(rate.count(start + seconds(10)));
}

TEST(WebRefusalLog, AKindIsToldAtOnceAndThenOnceAMinute) {
  RefusalLog log;
  const TimePoint now{seconds(100)};
  EXPECT_NE(log.line(Refusal::origin, "http://evil.example", now).find("evil.example"),
            std::string::npos);
  EXPECT_EQ(log.line(Refusal::origin, "http://evil.example", now + seconds(59)), "");
  EXPECT_NE(log.line(Refusal::token, "", now + seconds(59)), "");
  const std::string later = log.line(Refusal::origin, "", now + seconds(60));
  EXPECT_NE(later.find("1 more"), std::string::npos) << later;
}

TEST(WebRefusalLog, AStrangersTextIsMadeHarmless) {
  RefusalLog log;
  const std::string line =
      log.line(Refusal::host, "a\x1b[2J\r\n\"" + std::string(500, 'b'), TimePoint{seconds(100)});
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_LT(line.size(), 200U);
}

}  // namespace
}  // namespace tagwrench
