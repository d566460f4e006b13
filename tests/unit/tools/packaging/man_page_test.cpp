#include "host/tools/packaging/man_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/packaging/sample_app.h"

namespace tagwrench::test {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<ManPage> sample_pages() {
  const SampleApp sample;
  return man_pages(sample.app, "1.2.3");
}

std::string page_of(const std::string& name) {
  for (const ManPage& page : sample_pages()) {
    if (page.name == name) return page.text;
  }
  return "no page " + name;
}

TEST(ManPage, ThereIsOneForEachVerbThatPeopleUse) {
  std::vector<std::string> names;
  for (const ManPage& page : sample_pages()) names.push_back(page.name);
  EXPECT_THAT(names, testing::ElementsAre("tagwrench", "tagwrench-run", "tagwrench-board",
                                          "tagwrench-board-led"));
}

TEST(ManPage, NamesTheProgramOnceAndListsItsVerbs) {
  const std::string page = page_of("tagwrench");
  EXPECT_THAT(page, HasSubstr(".SH NAME\ntagwrench \\- a camera\n"));
  EXPECT_THAT(page, HasSubstr(".BR tagwrench\\-run (1)\ntrack the tags\n"));
  EXPECT_THAT(page, HasSubstr("tagwrench 1.2.3"));
  EXPECT_THAT(page, Not(HasSubstr("hidden")));
}

TEST(ManPage, OptionsHaveTheirNamesValuesAndDuties) {
  const std::string page = page_of("tagwrench-run");
  EXPECT_THAT(page, HasSubstr(".TP\n\\fB\\-f\\fR, \\fB\\-\\-frames\\fR \\fIINT\\fR\n"
                              "end after N frames\n(required)\n"));
  EXPECT_THAT(page, Not(HasSubstr("secret")));
  EXPECT_THAT(page_of("tagwrench-board-led"),
              HasSubstr(".B tagwrench board led\n[\\fIOPTION\\fR]...\n\\fIstate\\fR\n"));
}

TEST(ManPage, TablesKeepTheirLines) {
  EXPECT_THAT(page_of("tagwrench-run"),
              HasSubstr(".nf\n\\&  sim | sim:SCENARIO.yaml       the simulated sensor\n"
                        "\\&  v4l2:/dev/videoN[,WxH]\n.fi\nWithout it: a camera\n"));
}

TEST(ManPage, TextIsNoRequest) {
  EXPECT_THAT(page_of("tagwrench-run"), HasSubstr("with a \\e and\n\\&.a dot\n"));
}

}  // namespace
}  // namespace tagwrench::test
