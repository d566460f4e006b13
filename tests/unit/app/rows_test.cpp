// The rows of sources and outputs: that each can be said as its own help says, and that what is
// made of them names them all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/core/config_error.h"

namespace tagwrench::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string refusal_of_source(const std::string& text) {
  try {
    parse_source(text);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

std::string refusal_of_outputs(const std::vector<std::string>& texts) {
  try {
    parse_outputs(texts);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(SourceRows, HelpAndRefusalNameEverySource) {
  const std::string refusal = refusal_of_source("kinect");
  EXPECT_THAT(refusal, StartsWith("--source kinect: not a source; use "));
  for (const SourceRow& row : source_rows()) {
    const std::string form = std::string(row.name) + ":" + row.argument;
    EXPECT_THAT(refusal, HasSubstr(form));
    EXPECT_THAT(source_help(),
                HasSubstr("  " + (row.stands_alone ? row.name + (" | " + form) : form)));
  }
}

TEST(SourceRows, AnArgumentIsTakenWhereTheRowHasOne) {
  const SourceSpec recording = parse_source("recording:a:b.twr");
  EXPECT_TRUE(recording.is(SourceKind::recording));
  EXPECT_EQ(recording.argument, "a:b.twr");
  EXPECT_TRUE(parse_source("sim").is(SourceKind::simulator));
  for (const char* alone : {"v4l2", "v4l2:", "images", "recording:"})
    EXPECT_THAT(refusal_of_source(alone), HasSubstr("not a source")) << alone;
}

TEST(SourceRows, FormsAreThoseOfTheKindsThatWereAskedFor) {
  EXPECT_EQ(source_forms({SourceKind::images, SourceKind::simulator}),
            "sim | sim:SCENARIO.yaml | images:DIR");
}

TEST(OutputRows, HelpAndRefusalNameEveryOutputOnce) {
  const std::string refusal = refusal_of_outputs({"xml:-"});
  EXPECT_THAT(refusal, StartsWith("--output xml:-: not an output; use "));
  std::set<std::string> names;
  for (const OutputRow& row : output_rows()) {
    const std::string form = std::string(row.name) + row.argument;
    EXPECT_THAT(refusal, HasSubstr(form));
    EXPECT_THAT(output_help(), HasSubstr("  " + form + " "));
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
  }
}

TEST(OutputRows, AnArgumentIsTakenWhereTheRowHasOne) {
  EXPECT_EQ(parse_outputs({"jsonl:/dev/null"}).front().argument, "/dev/null");
  for (const char* wrong : {"jsonl", "jsonl:", "terminal:x", "gadget:mouse", "joystick:2"})
    EXPECT_THAT(refusal_of_outputs({wrong}), HasSubstr("not an output")) << wrong;
}

TEST(OutputRows, NoTwoShareAPlace) {
  EXPECT_THAT(refusal_of_outputs({"jsonl:-", "csv:-"}), HasSubstr("standard output"));
  EXPECT_THAT(refusal_of_outputs({"jsonl:/dev/null", "csv:/dev/null"}), HasSubstr("twice"));
  EXPECT_THAT(refusal_of_outputs({"wrench", "terminal", "wrench"}), HasSubstr("twice"));
  EXPECT_THAT(refusal_of_outputs({"web", "web:127.0.0.1:9000"}), HasSubstr("twice"));
}

TEST(OutputRows, WhatMovesByProfilesIsTheRowsWord) {
  const auto moves = [](const char* text) { return parse_outputs({text}).front().moves(); };
  EXPECT_TRUE(moves("spacemouse"));
  EXPECT_TRUE(moves("gadget"));
  EXPECT_FALSE(moves("gadget:wrench"));
  EXPECT_FALSE(moves("wrench"));
  EXPECT_FALSE(moves("csv:/dev/null"));
}

TEST(OutputRows, FilesGoOnAfterAJobAndTheViewDoesNot) {
  Outputs outputs(parse_outputs({"terminal", "csv:/dev/null"}), true);
  const SensorConfig sensor;
  outputs.open({.sensor = sensor, .source = "a test", .name = kUsualSensorName});
  const std::vector<Output*> before = outputs.all();
  ASSERT_EQ(before.size(), 2u);
  outputs.close_for_job();
  ASSERT_EQ(outputs.all().size(), 1u);
  EXPECT_EQ(outputs.all().front(), before.back());
  outputs.open({.sensor = sensor, .source = "a test", .name = kUsualSensorName});
  EXPECT_EQ(outputs.all().back(), before.back()) << "the file was begun anew";
  outputs.close();
  EXPECT_TRUE(outputs.all().empty());
}

}  // namespace
}  // namespace tagwrench::test
