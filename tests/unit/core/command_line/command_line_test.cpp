#include "host/core/command_line/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/core/config_error.h"

namespace tagwrench::test {
namespace {

using command_line::Command;
using command_line::Option;
using command_line::Program;

/// Empty: it has been understood.
std::string refusal(Program& program, std::vector<const char*> words) {
  words.insert(words.begin(), "tagwrench");
  try {
    program.parse(static_cast<int>(words.size()), words.data());
    return "";
  } catch (const ConfigError& e) {
    return e.what();
  }
}

/// What a check says of a word.
std::string said(const command_line::Check& check, std::string word) { return check.refusal(word); }

TEST(CommandLine, OptionsOfEachTypeArriveInTheirVariables) {
  Program program("a program");
  std::string text;
  std::filesystem::path path;
  int whole = 0;
  std::size_t size = 0;
  double number = 0;
  std::optional<int> maybe_whole;
  std::optional<long> maybe_long;
  std::optional<double> maybe_number;
  std::vector<std::string> words;
  std::vector<std::filesystem::path> paths;
  std::vector<int> wholes;
  std::vector<double> numbers;
  bool flag = false;
  program.add_option("--text", text);
  program.add_option("--path", path);
  program.add_option("--whole", whole);
  program.add_option("--size", size);
  program.add_option("--number", number);
  program.add_option("--maybe-whole", maybe_whole);
  program.add_option("--maybe-long", maybe_long);
  const Option last = program.add_option("--maybe-number", maybe_number);
  program.add_option("--words", words).expected(2);
  program.add_option("--wholes", wholes).delimiter(',');
  program.add_option("--numbers", numbers).delimiter(',');
  program.add_flag("--flag", flag, "a flag");
  program.add_option("paths", paths);
  EXPECT_EQ(refusal(program, {"--text",    "a b",     "--path", "/c d",         "--whole",
                              "-3",        "--size",  "4",      "--number",     "5.5",
                              "--words",   "x",       "y",      "--wholes",     "1,2",
                              "--numbers", "0.5,1e3", "--flag", "--maybe-long", "6",
                              "e f",       "g"}),
            "");
  EXPECT_EQ(text, "a b");
  EXPECT_EQ(path, "/c d");
  EXPECT_EQ(whole, -3);
  EXPECT_EQ(size, 4u);
  EXPECT_EQ(number, 5.5);
  EXPECT_FALSE(maybe_whole);
  EXPECT_EQ(maybe_long, 6);
  EXPECT_FALSE(maybe_number);
  EXPECT_EQ(last.count(), 0u);
  EXPECT_EQ(program.count("--whole"), 1u);
  EXPECT_THAT(words, testing::ElementsAre("x", "y"));
  EXPECT_THAT(paths, testing::ElementsAre("e f", "g"));
  EXPECT_THAT(wholes, testing::ElementsAre(1, 2));
  EXPECT_THAT(numbers, testing::ElementsAre(0.5, 1000));
  EXPECT_TRUE(flag);
}

TEST(CommandLine, WrongUsageNamesTheCommandWhoseHelpTellsMore) {
  const auto refused = [](const std::vector<const char*>& words) {
    Program program("a program");
    program.require_subcommand();
    int count = 0;
    Command board = program.add_subcommand("board", "the board");
    board.require_subcommand();
    board.add_subcommand("led", "its light").add_option("--count", count);
    board.add_subcommand("secret", "for programs").hidden();
    program.add_subcommand("run", "go");
    return refusal(program, words);
  };
  EXPECT_EQ(refused({}), "`tagwrench` needs a subcommand: board, run; see `tagwrench --help`");
  EXPECT_EQ(refused({"walk"}),
            "`tagwrench` has no subcommand 'walk' but board, run; see `tagwrench --help`");
  EXPECT_EQ(refused({"board"}),
            "`tagwrench board` needs a subcommand: led; see `tagwrench board --help`");
  EXPECT_EQ(refused({"board", "led", "--count", "x"}),
            "Could not convert: --count = x; `tagwrench board led --help` lists what there is");
}

TEST(CommandLine, CheckBeforeACommandMayMissAnOption) {
  Program program("a program");
  program.runs([] { return 0; }, [] { command_line::missing("--sensor"); });
  EXPECT_EQ(refusal(program, {}), "--sensor is required; `tagwrench --help` lists what there is");
}

TEST(CommandLine, RunsWhatWasGiven) {
  Program program("a program");
  program.add_subcommand("run", "go").runs([] { return 1; });
  Command board = program.add_subcommand("board", "the board");
  board.add_subcommand("led", "its light").runs([] { return 2; });
  board.add_subcommand("info", "who it is").runs([] { return 3; });
  EXPECT_EQ(refusal(program, {"board", "led"}), "");
  EXPECT_EQ(program.action()(), 2);
}

TEST(CommandLine, HelpAndVersionEndTheParsing) {
  Program program("a program", "1.2.3");
  const char* const words[] = {"tagwrench", "--version"};
  testing::internal::CaptureStdout();
  EXPECT_FALSE(program.parse(2, words));
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "1.2.3\n");
}

TEST(CommandLine, WhatIsHiddenIsNotListed) {
  Program program("a program");
  std::string text;
  program.add_option("--shown", text);
  program.add_option("--hidden", text).hidden();
  program.add_subcommand("for-programs", "").hidden();
  EXPECT_TRUE(program.subcommands().empty());
  std::vector<std::string> names;
  for (const Option& option : program.options()) names.push_back(option.name());
  EXPECT_THAT(names, testing::ElementsAre("--help", "--shown"));
}

TEST(Check, NumberNeverIsNan) {
  const command_line::Check check = command_line::number(0, 5, "a mass", "NUMBER");
  EXPECT_EQ(said(check, "5"), "");
  EXPECT_EQ(said(check, "5.1"), "'5.1' is not a mass");
  EXPECT_EQ(said(check, "nan"), "'nan' is not a mass");
  EXPECT_EQ(said(check, "1 kg"), "'1 kg' is not a mass");
  EXPECT_EQ(said(command_line::seconds(), "0"), "'0' is not a number of seconds from 0.001 to 1e9");
}

TEST(Check, SetsAndRangesSayWhatFits) {
  EXPECT_EQ(said(command_line::range(1, 3), "4"), "Value 4 not in range 1 to 3");
  EXPECT_EQ(said(command_line::range(0.5, 1.5), "1"), "");
  EXPECT_EQ(said(command_line::positive_number(), "2"), "");
  EXPECT_NE(said(command_line::positive_number(), "0"), "");
  EXPECT_EQ(said(command_line::one_of({"on", "off"}), "dim"), "dim not in {on,off}");
  EXPECT_EQ(said(command_line::one_of({10, 80}), "80"), "");
}

TEST(ToNumber, TakesAllOfTheTextOrNothing) {
  EXPECT_EQ(command_line::to_number("-1.5e3"), -1500);
  EXPECT_FALSE(command_line::to_number(""));
  EXPECT_FALSE(command_line::to_number("1x"));
}

}  // namespace
}  // namespace tagwrench::test
