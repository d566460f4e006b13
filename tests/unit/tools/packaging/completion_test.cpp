#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/tools/packaging/man_page.h"
#include "tests/unit/tools/packaging/sample_app.h"

namespace tagwrench::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Words = std::vector<std::string>;

Completion after(const Words& typed) {
  const SampleApp sample;
  return complete(sample.app, typed, {"cad", "game"});
}

TEST(Completion, OffersTheVerbsThatPeopleUse) {
  EXPECT_THAT(after({""}).words, ElementsAre("run", "board"));
  EXPECT_THAT(after({"b"}).words, ElementsAre("board"));
  EXPECT_THAT(after({"hid"}).words, IsEmpty());
  EXPECT_THAT(after({"board", ""}).words, ElementsAre("led"));
}

TEST(Completion, OffersTheOptionsOfTheVerbThatWasReached) {
  EXPECT_THAT(after({"run", "--s"}).words, ElementsAre("--source", "--sensor"));
  EXPECT_THAT(after({"board", "--s"}).words, IsEmpty());
  EXPECT_THAT(after({"run", "--fast", "--fr"}).words, ElementsAre("--frames"));
}

TEST(Completion, TakesListsOfValuesFromTheHelpText) {
  EXPECT_THAT(after({"run", "--source", ""}).words, ElementsAre("sim", "sim:", "v4l2:"));
  EXPECT_THAT(after({"run", "--output", ""}).words, ElementsAre("jsonl:", "csv:", "spnav"));
  EXPECT_THAT(after({"run", "--source", "=", "v"}).words, ElementsAre("v4l2:"));
  EXPECT_THAT(after({"board", "led", "o"}).words, ElementsAre("on", "off"));
}

TEST(Completion, OffersFilesWhereOneFits) {
  const Completion sensor = after({"run", "--sensor", "se"});
  EXPECT_TRUE(sensor.files);
  EXPECT_EQ(sensor.before_file, "");
  const Completion output = after({"run", "--output", "csv:a"});
  EXPECT_TRUE(output.files);
  EXPECT_EQ(output.before_file, "csv:");
  EXPECT_THAT(output.words, IsEmpty());
  EXPECT_FALSE(after({"run", "--frames", ""}).files);
  EXPECT_FALSE(after({"run", "--output", "s"}).files);
  const Completion profile = after({"run", "--profile", "c"});
  EXPECT_TRUE(profile.files);
  EXPECT_THAT(profile.words, ElementsAre("cad"));
}

TEST(Completion, TheValueOfAnOptionIsNoVerb) {
  EXPECT_THAT(after({"run", "--sensor", "board", "--fa"}).words, ElementsAre("--fast"));
}

TEST(Completion, NothingTypedIsNothingToComplete) { EXPECT_THAT(after({}).words, IsEmpty()); }

}  // namespace
}  // namespace tagwrench::test
