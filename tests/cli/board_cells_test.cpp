// Load cells by `tagwrench board` as its users run it, against a model of a board.
#include <sys/stat.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "board_cli.h"

namespace tagwrench::test {
namespace {

using link::BoardModel;
using link::ServedBoard;
using nlohmann::json;

TEST_F(BoardCliTest, ACellsFileThatIsNoneIsSaid) {
  const std::string none = (folder / "none.json").string();
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"watch"}, {"log", "--out", "-"}, {"tare"}}) {
    std::vector<std::string> words{"board"};
    words.insert(words.end(), verb.begin(), verb.end());
    words.insert(words.end(), {"--cells", none, "--port", "/dev/null"});
    const Outcome got = run_bridge(words);
    EXPECT_EQ(got.status, 2) << verb[0];
    EXPECT_EQ(got.err, "tagwrench: --cells " + none + ": there is no such file\n");
  }
  ServedBoard board;
  write_file(folder / "other.json", "{}");
  const Outcome other = run_bridge(
      {"board", "watch", "--cells", (folder / "other.json").string(), "--port", board.path()});
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("give another file"), std::string::npos) << other.err;
  EXPECT_EQ(other.err.find("remove it"), std::string::npos) << other.err;
}

TEST_F(BoardCliTest, CalibrateCellMakesNewtonsThatWatchShows) {
  ServedBoard board;
  const std::string keys = (folder / "keys").string();
  ASSERT_EQ(::mkfifo(keys.c_str(), 0600), 0);
  UniqueFd keyboard(::open(keys.c_str(), O_RDWR | O_CLOEXEC));
  board.set_counts(1000);
  Bridge bridge({"board", "calibrate-cell", "--channel", "0", "--mass", "0,0.5", "--port",
                 board.path(), "--conversions", "20"},
                keys);
  ASSERT_TRUE(bridge.wait_for_message("take everything off"));
  ASSERT_EQ(::write(keyboard.get(), "\n", 1), 1);
  ASSERT_TRUE(bridge.wait_for_message("put 0.5 kg"));
  board.set_counts(1000 + 49'033);
  ASSERT_EQ(::write(keyboard.get(), "\n", 1), 1);
  const Outcome got = bridge.finish();
  EXPECT_EQ(got.status, 0) << got.err;
  EXPECT_NE(got.out.find("board-0102030405060708.json"), std::string::npos) << got.out;

  Bridge watch({"board", "watch", "--json", "--port", board.path()});
  ASSERT_TRUE(watch.wait_for_lines(20)) << watch.err();
  watch.signal(SIGINT);
  for (const std::string& text : lines_of(watch.finish().out)) {
    const json line = json::parse(text);
    if (line["channel"] == 0) {
      EXPECT_NEAR(line["f_n"].get<double>(), 4.9033, 1e-3);
    } else {
      EXPECT_TRUE(line["f_n"].is_null()) << "not calibrated: no newtons";
    }
  }
  // The zero follows a tare (the model always answers 1234).
  const Outcome tare = run_bridge({"board", "tare", "--port", board.path()});
  EXPECT_EQ(tare.status, 0) << tare.err;
  EXPECT_NE(tare.out.find("cell 0: zero moved by +0.0234 N"), std::string::npos) << tare.out;
  EXPECT_NE(tare.out.find("kept in " + folder.path()), std::string::npos) << tare.out;
  EXPECT_NE(tare.err.find("left out, not calibrated: load cell 1, 2, 3"), std::string::npos)
      << tare.err;
}

TEST_F(BoardCliTest, ACellThatMovesIsNotTared) {
  const std::string cells = (folder / "one.json").string();
  std::string one = kCells;
  one = one.substr(0, one.find(R"(,{"channel":1)")) + "]}";
  write_file(cells, one);
  ServedBoard board(0xF, [](BoardModel& m) { m.tare_result = {0, 1234, 2000, 160}; });
  const Outcome got = run_bridge({"board", "tare", "--cells", cells, "--port", board.path()});
  EXPECT_EQ(got.status, 1);
  EXPECT_NE(got.err.find("load cell 0 moved while it was tared (2 N from end to end); let it rest"),
            std::string::npos)
      << got.err;
  EXPECT_EQ(got.out, "");
  EXPECT_EQ(read_file(cells), one) << "nothing is kept";
}

TEST_F(BoardCliTest, MassesThatDoNotSpanAreRefused) {
  const Outcome same =
      run_bridge({"board", "calibrate-cell", "--channel", "0", "--mass", "0.5,0.5"});
  EXPECT_EQ(same.status, 2);
  EXPECT_NE(same.err.find("all masses are the same: give at least two different"),
            std::string::npos)
      << same.err;
  ServedBoard board;
  write_file(folder / "keys", "\n\n");
  Bridge bridge({"board", "calibrate-cell", "--channel", "0", "--mass", "0,0.5", "--port",
                 board.path(), "--conversions", "10"},
                (folder / "keys").string());
  const Outcome unmoved = bridge.finish();
  EXPECT_EQ(unmoved.status, 2) << "nothing was put on";
  EXPECT_NE(unmoved.err.find("take a larger mass"), std::string::npos) << unmoved.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "tagwrench"));
}

TEST_F(BoardCliTest, AnUnwiredCellIsSaidWhenItIsCalibrated) {
  ServedBoard board(0b1110);
  const Outcome got = run_bridge(
      {"board", "calibrate-cell", "--channel", "0", "--mass", "0,0.5", "--port", board.path()});
  EXPECT_EQ(got.status, 2);
  EXPECT_NE(got.err.find("load cell 0 does not answer; check the wires"), std::string::npos);
  EXPECT_EQ(lines_in(got.err), 1u) << "before anything is put on: " << got.err;
}

}  // namespace
}  // namespace tagwrench::test
