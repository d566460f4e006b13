// What pages are told of a job, from what the job says.
#include <gtest/gtest.h>

#include "host/web/bridge/job_command.h"

namespace tagwrench {
namespace {

TEST(JobReports, KeepTheLastLinesByTheirKind) {
  JobReport report("wrench", {"skip", "redo", "stop"});
  report.said("tagwrench: source: sim");
  report.said("tagwrench: > hang 50 g at left");
  EXPECT_FALSE(report.event(R"({"line":{"kind":"warning","text":"it was bumped"}})"));
  EXPECT_FALSE(report.event(R"({"live":"holding still","coverage":{"axes":[1,0,0,0,0,0]}})"));
  EXPECT_FALSE(report.event(R"({"progress":0.25})"));
  const nlohmann::json job = report.to_json();
  EXPECT_EQ(job["state"], "running");
  EXPECT_EQ(job["lines"][0]["kind"], "note");
  EXPECT_EQ(job["lines"][1]["kind"], "task");
  EXPECT_EQ(job["lines"][1]["text"], "hang 50 g at left");
  EXPECT_EQ(job["lines"][2]["kind"], "warning");
  EXPECT_EQ(job["live"], "holding still");
  EXPECT_EQ(job["coverage"]["axes"][0], 1);
  EXPECT_EQ(job["progress"], 0.25);
  EXPECT_EQ(job["keys"].size(), 3U);
  for (int i = 0; i < 300; ++i) report.said("tagwrench: more");
  EXPECT_EQ(report.to_json()["lines"].size(), JobReport::kMaxLines);
}

TEST(JobReports, TakeNoHarmFromDamagedEvents) {
  JobReport report("target", {"stop"});
  for (const char* damaged : {"", "{", "[]", "3", "null", R"({"line":3})", R"({"line":{"kind":1}})",
                              R"({"live":[]})", R"({"coverage":"x"})", R"({"progress":"half"})",
                              R"({"picture":{}})", R"({"picture":{"jpeg":"!!!!","tags":[]}})",
                              R"({"picture":{"jpeg":"AAAA","tags":[],"width":-1,"height":2}})"})
    EXPECT_FALSE(report.event(damaged)) << damaged;
  EXPECT_EQ(report.to_json()["lines"].size(), 0U);
  const auto picture =
      report.event(R"({"picture":{"jpeg":"/9j/","tags":[],"width":640,"height":480}})");
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->jpeg, (std::vector<std::uint8_t>{0xff, 0xd8, 0xff}));
}

TEST(JobReports, EndWithWhatWasFoundOrWhyNot) {
  JobReport doctor("doctor", {"stop"});
  doctor.printed("camera: fine\n");
  doctor.ended(JobReport::State::done, {}, nullptr);
  EXPECT_EQ(doctor.to_json()["result"]["text"], "camera: fine\n");
  EXPECT_TRUE(doctor.to_json()["keys"].empty());
  JobReport target("target", {"stop"});
  target.said("tagwrench: too few different pictures; move more");
  target.ended(JobReport::State::failed, {}, nullptr);
  EXPECT_EQ(target.to_json()["lines"][0]["kind"], "warning");
  EXPECT_EQ(target.to_json()["result"], nullptr);
}

TEST(Base64, IsReadOrRefused) {
  EXPECT_EQ(from_base64("aGk="), (std::vector<std::uint8_t>{'h', 'i'}));
  EXPECT_EQ(from_base64(""), std::vector<std::uint8_t>{});
  for (const char* bad : {"a", "aGk", "a=k=", "aG k", "=AAA"})
    EXPECT_FALSE(from_base64(bad)) << bad;
}

}  // namespace
}  // namespace tagwrench
