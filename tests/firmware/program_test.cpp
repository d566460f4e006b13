// The whole program against the flashable image: two processes and a pseudo terminal between them.
// Events are waited for; accuracy and time limits are tested in virtual time elsewhere.
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/firmware/board_process.h"

namespace tagwrench::test {
namespace {

using nlohmann::json;

std::vector<json> samples(const std::string& out) {
  std::vector<json> all;
  std::istringstream lines(out);
  for (std::string line; std::getline(lines, line);) {
    const json one = json::parse(line, nullptr, false);
    if (!one.is_discarded()) all.push_back(one);
  }
  return all;
}

/// What has come by now, and does not wait in the pipe.
std::ptrdiff_t lines_so_far(Bridge& bridge) {
  bridge.has_lines(0);
  return static_cast<std::ptrdiff_t>(lines_in(bridge.out()));
}

std::vector<bool> button_events(const Bridge& bridge) {
  std::vector<bool> events;
  for (const json& sample : samples(bridge.out())) {
    if (sample["kind"] == "button") events.push_back(sample["pressed"]);
  }
  return events;
}

struct Program : testing::Test {
  TemporaryFolder folder;

  Program() { ::setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1); }

  /// The emulated cells: 100,000 counts a newton, 20,000 at rest.
  std::string cells_file() const {
    std::string cells;
    for (int i = 0; i < 4; ++i) {
      cells += i == 0 ? "" : ",";
      cells += R"({"channel":)" + std::to_string(i) +
               R"(,"newtons_per_count":1e-5,"newtons_per_count_sigma":1e-9,"zero_counts":20000,)"
               R"("zero_sigma_counts":1,"noise_counts":20,"residual_n":0})";
    }
    write_file(folder / "cells.json",
               R"({"format":"tagwrench-cells-1","board":"","cells":[)" + cells + "]}");
    return (folder / "cells.json").string();
  }
  std::vector<std::string> watching(const BoardProcess& board) const {
    return {"board", "watch", "--json", "--cells", cells_file(), "--port", board.port()};
  }
};

TEST_F(Program, InfoPrintsTheIdentity) {
  BoardProcess board(folder);
  const Outcome got = run_bridge({"board", "info", "--json", "--port", board.port()});
  EXPECT_EQ(got.status, 0) << got.err;
  const json about = json::parse(got.out, nullptr, false);
  ASSERT_FALSE(about.is_discarded()) << got.out;
  EXPECT_EQ(about["board"], "atmega328p");
  EXPECT_EQ(about["cells"], 4);
  EXPECT_EQ(about["reset_cause"], "reset pin") << "opening an Arduino's port resets it";
  EXPECT_EQ(about["id"].get<std::string>().size(), 16U) << "it was given one";
  EXPECT_EQ(about["overruns"], 0);
}

TEST_F(Program, TheIdThatItWasGivenIsKept) {
  BoardProcess board(folder);
  const auto id = [&] {
    const Outcome got = run_bridge({"board", "info", "--json", "--port", board.port()});
    return json::parse(got.out, nullptr, false).value("id", std::string());
  };
  const std::string first = id();
  EXPECT_EQ(first.size(), 16U);
  board.order("power");
  EXPECT_EQ(id(), first);
}

TEST_F(Program, WatchShowsFourCellsInNewtonsWithTimes) {
  BoardProcess board(folder,
                     {"--cell", "0=0.5", "--cell", "1=-1", "--cell", "2=1.5", "--cell", "3=0"});
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(400)) << watch.err();
  watch.signal(SIGINT);
  const Outcome got = watch.finish();
  EXPECT_EQ(got.status, 0) << got.err;
  const std::array<double, 4> expected{0.5, -1, 1.5, 0};
  std::array<int, 4> seen{};
  std::array<std::int64_t, 4> last{};
  std::array<int, 4> gaps{};
  for (const json& sample : samples(got.out)) {
    if (sample["kind"] != "cell") continue;
    const std::size_t channel = sample["channel"];
    const std::int64_t time = sample["t_ns"];
    EXPECT_NEAR(sample["f_n"].get<double>(), expected.at(channel), 0.002) << "N";
    EXPECT_GT(time, last.at(channel));
    last.at(channel) = time;
    gaps.at(channel) += sample["lost_before"].get<int>();
    ++seen.at(channel);
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_GT(seen.at(i), 50);
    EXPECT_EQ(gaps.at(i), 0);
  }
}

TEST_F(Program, ACellThatIsNotNamedIsNotWired) {
  BoardProcess board(folder, {"--cell", "0=0.5", "--cell", "1=none", "--cell", "3=sine:2:0.5"});
  Bridge watch(watching(board));
  EXPECT_TRUE(watch.wait_for_message("cell 1"));
  EXPECT_TRUE(watch.wait_for_message("cell 2"));
  ASSERT_TRUE(watch.wait_for_lines(lines_so_far(watch) + 40));
  std::set<int> wired;
  for (const json& sample : samples(watch.out())) {
    if (sample["kind"] == "cell") wired.insert(sample["channel"].get<int>());
  }
  EXPECT_EQ(wired, (std::set<int>{0, 3}));
}

TEST_F(Program, ACellThatIsPulledOffIsSaidWhileTheOthersGoOn) {
  BoardProcess board(folder);
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(40)) << watch.err();
  board.order("cell 2 disconnect");
  EXPECT_TRUE(watch.wait_for_message("cell 2"));
  const auto lines = lines_so_far(watch);
  EXPECT_TRUE(watch.wait_for_lines(lines + 40));
}

TEST_F(Program, TheLightGoesOffWhenTheBridgeIsKilled) {
  BoardProcess board(folder);
  Bridge led({"board", "led", "20%", "--port", board.port()});
  EXPECT_NEAR(board.next_light(), 0.2, 0.003);
  led.signal(SIGKILL);
  EXPECT_EQ(led.finish().status, 128 + SIGKILL);
  EXPECT_FALSE(board.light_changed()) << "only its silence tells the board";
  EXPECT_EQ(board.next_light(), 0);
}

TEST_F(Program, TheLightGoesOffWhenTheBridgeEnds) {
  BoardProcess board(folder);
  Bridge led({"board", "led", "20%", "--port", board.port()});
  EXPECT_NEAR(board.next_light(), 0.2, 0.003);
  led.signal(SIGINT);
  EXPECT_EQ(led.finish().status, 0);
  EXPECT_EQ(board.next_light(), 0);
}

TEST_F(Program, AHangPutsTheLightOutAndTheBridgeLightsItAgain) {
  BoardProcess board(folder);
  Bridge led({"board", "led", "20%", "--port", board.port()});
  EXPECT_NEAR(board.next_light(), 0.2, 0.003);
  board.order("hang");
  EXPECT_EQ(board.next_light(), 0);
  EXPECT_NEAR(board.next_light(), 0.2, 0.003);
  EXPECT_TRUE(led.wait_for_message("watchdog")) << "and it says why";
}

TEST_F(Program, TheCableMayComeOutAndGoInAgain) {
  BoardProcess board(folder);
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(80)) << watch.err();
  board.order("unplug");
  ASSERT_TRUE(watch.wait_for_message("gone")) << watch.err();
  board.order("plug");
  ASSERT_TRUE(watch.wait_for_message("back")) << watch.err();
  auto lines = lines_so_far(watch);
  ASSERT_TRUE(watch.wait_for_lines(lines + 80)) << watch.err();
  board.order("unplug");  // loose for a moment
  board.order("plug");
  lines = lines_so_far(watch);
  EXPECT_TRUE(watch.wait_for_lines(lines + 400)) << watch.err();
  watch.signal(SIGINT);
  EXPECT_EQ(watch.finish().status, 0);
}

TEST_F(Program, AResetInTheStreamIsSaidAndTheStreamGoesOn) {
  for (const char* mishap : {"reset", "hang", "power"}) {
    const TemporaryFolder own;
    BoardProcess board(own);
    Bridge watch(watching(board));
    ASSERT_TRUE(watch.wait_for_lines(80)) << watch.err();
    board.order(mishap);
    ASSERT_TRUE(watch.wait_for_message("start")) << mishap << ": " << watch.err();
    const auto lines = lines_so_far(watch);
    ASSERT_TRUE(watch.wait_for_lines(lines + 80)) << mishap << ": " << watch.err();
    watch.signal(SIGINT);
    const Outcome got = watch.finish();
    EXPECT_EQ(got.status, 0);
    std::int64_t last = 0;
    for (const json& sample : samples(got.out)) {
      if (sample["kind"] != "cell" || sample["channel"] != 0) continue;
      EXPECT_GT(sample["t_ns"].get<std::int64_t>(), last) << mishap;
      last = sample["t_ns"];
    }
  }
}

TEST_F(Program, NoiseOfOneBitInAThousandCostsFramesOnly) {
  BoardProcess board(folder,
                     {"--cell", "0=0.5", "--cell", "1=0", "--cell", "2=0", "--cell", "3=0"});
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(100)) << watch.err();
  board.order("noise 0.001");
  ASSERT_TRUE(watch.wait_for_lines(1500)) << watch.err();
  watch.signal(SIGINT);
  const Outcome got = watch.finish();
  EXPECT_EQ(got.status, 0) << got.err;
  int wrong = 0;
  int lost = 0;
  for (const json& sample : samples(got.out)) {
    if (sample["kind"] != "cell" || sample["channel"] != 0) continue;
    wrong += std::abs(sample["f_n"].get<double>() - 0.5) > 0.002 ? 1 : 0;
    lost += sample["lost_before"].get<int>();
  }
  EXPECT_EQ(wrong, 0) << "a damaged frame is dropped, never shown";
  EXPECT_GT(lost, 0) << "and its sample is missed";
}

TEST_F(Program, GarbageInTheStreamIsDropped) {
  BoardProcess board(folder,
                     {"--cell", "0=0.5", "--cell", "1=0", "--cell", "2=0", "--cell", "3=0"});
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(80)) << watch.err();
  for (int i = 0; i < 20; ++i) {
    board.order("babble 200");
    const auto lines = lines_so_far(watch);
    ASSERT_TRUE(watch.wait_for_lines(lines + 10)) << watch.err();
  }
  watch.signal(SIGINT);
  const Outcome got = watch.finish();
  EXPECT_EQ(got.status, 0);
  for (const json& sample : samples(got.out)) {
    if (sample["kind"] != "cell" || sample["channel"] != 0) continue;
    EXPECT_NEAR(sample["f_n"].get<double>(), 0.5, 0.002);
  }
}

TEST_F(Program, ASecondHostIsRefusedAndTheFirstGoesOn) {
  BoardProcess board(folder);
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(40)) << watch.err();
  const Outcome second = run_bridge({"board", "info", "--port", board.port()});
  EXPECT_EQ(second.status, 2) << second.err;
  EXPECT_EQ(lines_in(second.err), 1U) << second.err;
  const auto lines = lines_so_far(watch);
  EXPECT_TRUE(watch.wait_for_lines(lines + 40)) << watch.err();
}

TEST_F(Program, AnotherVersionOfTheFirmwareIsRefusedAndSaid) {
  for (const auto& [major, remedy] :
       {std::pair{"0", "update the board"}, std::pair{"9", "update tagwrench"}}) {
    const TemporaryFolder own;
    BoardProcess board(own, {"--protocol-major", major});
    const Outcome got = run_bridge({"board", "info", "--port", board.port()});
    EXPECT_EQ(got.status, 2);
    EXPECT_NE(got.err.find(remedy), std::string::npos) << got.err;
  }
}

TEST_F(Program, AFullDiskEndsTheLogWithOneLine) {
  BoardProcess board(folder);
  const Outcome got = run_bridge({"board", "log", "--out", "/dev/full", "--port", board.port()});
  EXPECT_EQ(got.status, 1);
  EXPECT_NE(got.err.find("/dev/full"), std::string::npos) << got.err;
}

TEST_F(Program, AButtonIsShownOnce) {
  BoardProcess board(folder);
  Bridge watch(watching(board));
  ASSERT_TRUE(watch.wait_for_lines(40)) << watch.err();
  for (const bool pressed : {true, false}) {
    const std::size_t before = button_events(watch).size();
    board.order(pressed ? "button 1 press" : "button 1 release");
    while (button_events(watch).size() == before)
      ASSERT_TRUE(watch.wait_for_lines(lines_so_far(watch) + 10)) << watch.err();
    ASSERT_TRUE(watch.wait_for_lines(lines_so_far(watch) + 80)) << "and nothing more";
  }
  EXPECT_EQ(button_events(watch), (std::vector<bool>{true, false}));
}

/// Both programs that stand for a board, and what their users get wrong.
struct BoardProgram : testing::TestWithParam<const char*> {
  TemporaryFolder folder;
  const std::string port = (folder / "port").string();

  void expect_refused(std::vector<std::string> arguments, const std::string& message) const {
    arguments.insert(arguments.end(), {"--port", port});
    const Outcome got = Bridge(arguments, "/dev/null", GetParam()).finish();
    EXPECT_EQ(got.status, 2) << got.err;
    EXPECT_EQ(lines_in(got.err), 1U) << got.err;
    EXPECT_NE(got.err.find(message), std::string::npos) << got.err;
    EXPECT_EQ(got.out, "");
  }
  void wait_for_port() const { wait_for_file(port); }
};

INSTANTIATE_TEST_SUITE_P(All, BoardProgram,
                         testing::Values(TAGWRENCH_EMULATED_BOARD, TAGWRENCH_BOARD_PC),
                         [](const auto& program) {
                           return program.index == 0 ? "emulated" : "pc";
                         });

TEST_P(BoardProgram, LeavesAFileThatHasItsNameAlone) {
  write_file(port, "precious");
  expect_refused({}, port + ": is there and no symbolic link; give --port a name that is free");
  EXPECT_EQ(read_file(port), "precious");
}

TEST_P(BoardProgram, LeavesALinkToSomethingElseAlone) {
  write_file(folder / "file", "precious");
  std::filesystem::create_symlink(folder / "file", port);
  expect_refused({}, "give --port a name that is free");
  EXPECT_EQ(read_file(port), "precious");
}

TEST_P(BoardProgram, LeavesTheNameOfALivingBoardAlone) {
  Bridge first({"--port", port}, "/dev/null", GetParam());
  wait_for_port();
  const auto terminal = std::filesystem::read_symlink(port);
  expect_refused({}, port + ": another program serves it");
  EXPECT_EQ(std::filesystem::read_symlink(port), terminal);
  first.signal(SIGTERM);
  EXPECT_EQ(first.finish().status, 0);
  EXPECT_FALSE(std::filesystem::is_symlink(port)) << "and it goes with its board";
}

TEST_P(BoardProgram, TakesTheNameOfABoardThatIsGone) {
  std::filesystem::create_symlink("/dev/pts/987654321", port);
  Bridge board({"--port", port}, "/dev/null", GetParam());
  wait_for_port();
  EXPECT_TRUE(std::filesystem::is_character_file(port));
}

TEST_P(BoardProgram, LeavesANameThatAnotherHasTakenMeanwhile) {
  Bridge board({"--port", port}, "/dev/null", GetParam());
  wait_for_port();
  std::filesystem::remove(port);
  std::filesystem::create_symlink("/dev/pts/987654321", port);
  board.signal(SIGTERM);
  EXPECT_EQ(board.finish().status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(port));
}

TEST_P(BoardProgram, RefusesANameWithoutAFolder) {
  const Outcome got = Bridge({"--port", "/nonexistent/board"}, "/dev/null", GetParam()).finish();
  EXPECT_EQ(got.status, 2);
  EXPECT_EQ(lines_in(got.err), 1U) << got.err;
  EXPECT_NE(got.err.find("/nonexistent/board: cannot be made"), std::string::npos) << got.err;
}

TEST_P(BoardProgram, RefusesACellThatCannotBe) {
  for (const char* cell : {"7=1", "0", "0=", "0=0.5N", "=1", "0=sine:1", "0=1e999", "0:1"}) {
    expect_refused({"--cell", cell}, cell);
    EXPECT_FALSE(std::filesystem::is_symlink(port)) << "no start";
  }
}

}  // namespace
}  // namespace tagwrench::test
