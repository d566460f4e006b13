// Newtons by one load cell on the board, the whole program against the flashable image: the
// simulated person presses the emulated cell, whose counts come over the serial port. In real time.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/firmware/board_process.h"

namespace tagwrench::test {
namespace {

using nlohmann::json;

// A small picture; pushes from three sides.
const char* const kScenario = R"(seed: 3
camera: {width: 320, height: 240, fx: 402.5, fy: 402.5, cx: 159.5, cy: 119.5}
optics: {psf_sigma_px: 0.6}
)";
const char* const kPlan = R"(about: short
reference: load_cell
cell_channel: 1
points:
  - {name: right, position_mm: [15, 0, 6]}
  - {name: left, position_mm: [-15, 0, 6]}
  - {name: lower, position_mm: [0, 15, 6]}
  - {name: top, position_mm: [0, 0, 6]}
mountings:
  - name: standing
    gravity: [0, 0, -1]
    say: stand it up
    steps:
      - {do: rest}
      - {do: push, at: top, along: [0, 0, -1], up_to_n: 1.5, seconds: 3}
      - {do: push, at: right, along: [0, 0, -1], up_to_n: 0.8, seconds: 3}
      - {do: push, at: lower, along: [0, 0, -1], up_to_n: 0.8, seconds: 3}
      - {do: push, at: left, along: [1, 0, 0], up_to_n: 0.7, seconds: 3}
      - {do: push, at: right, along: [-1, 0, 0], up_to_n: 0.7, seconds: 3}
      - {do: rest}
)";

const char* const kTooSlow =
    "calibrated; but this machine does not keep up with a check in real time";

struct Newtons : testing::Test {
  TemporaryFolder folder;
  std::string scenario = (folder / "scenario.yaml").string();
  std::string sensor = (folder / "frames" / "sensor.yaml").string();
  std::string calibration = (folder / "frames" / "measured" / "wrench.json").string();

  Newtons() {
    ::setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
    write_file(scenario, kScenario);
    write_file(folder / "plan.yaml", kPlan);
  }
  void make_sensor() {
    const std::string frames = (folder / "frames").string();
    ASSERT_EQ(
        run_bridge({"sim", "--scenario", scenario, "--out", frames, "--frames", "150"}).status, 0);
    const Outcome target =
        run_bridge({"calibrate", "target", "--sensor", sensor, "--source", "images:" + frames});
    ASSERT_EQ(target.status, 0) << target.err;
  }
  /// As the owner does it: nothing on it, then 100 g.
  void calibrate_cell(BoardProcess& board) const {
    const std::string keys = (folder / "keys").string();
    ASSERT_EQ(::mkfifo(keys.c_str(), 0600), 0);
    const UniqueFd keyboard(::open(keys.c_str(), O_RDWR | O_CLOEXEC));
    Bridge bridge({"board", "calibrate-cell", "--channel", "1", "--mass", "0,0.1", "--port",
                   board.port(), "--conversions", "100"},
                  keys);
    ASSERT_TRUE(bridge.wait_for_message("take everything off")) << bridge.err();
    ASSERT_EQ(::write(keyboard.get(), "\n", 1), 1);
    ASSERT_TRUE(bridge.wait_for_message("put 0.1 kg")) << bridge.err();
    board.order("cell 1 0.980665");
    ASSERT_EQ(::write(keyboard.get(), "\n", 1), 1);
    const Outcome got = bridge.finish();
    ASSERT_EQ(got.status, 0) << got.err;
    board.order("cell 1 0");
  }
  /// Nothing, if the hand's press came too short for a judgement three times: a machine that does
  /// not keep up with real time.
  Outcome check_scale(const BoardProcess& board) const {
    for (int tries = 0; tries < 3; ++tries) {
      Outcome outcome = run_bridge(
          with_board({"check", "--channel", "1", "--at", "0,0,6", "--direction", "0,0,-1"}, board));
      if (outcome.out.find("?      scale") == std::string::npos) return outcome;
    }
    return {};
  }
  std::vector<std::string> with_board(std::vector<std::string> words,
                                      const BoardProcess& board) const {
    words.insert(words.end(), {"--sensor", sensor, "--source", "sim:" + scenario, "--board",
                               board.port(), "--emulated-cell", (folder / "orders").string()});
    return words;
  }
};

TEST_F(Newtons, APlanForALoadCellIsDoneWithTheBoardAndCheckedWithIt) {
  make_sensor();
  BoardProcess board(folder, {"--cell", "1=0"});
  calibrate_cell(board);
  const Outcome pipe = run_bridge({"calibrate", "wrench", "--sensor", sensor, "--source",
                                   "sim:" + scenario, "--plan", folder / "plan.yaml", "--board",
                                   board.port(), "--emulated-cell", (folder / "none").string()});
  EXPECT_EQ(pipe.status, 2);
  EXPECT_NE(pipe.err.find("--emulated-cell " + (folder / "none").string() + ": No such file"),
            std::string::npos)
      << pipe.err;

  const Outcome got =
      run_bridge(with_board({"calibrate", "wrench", "--plan", folder / "plan.yaml"}, board));
  ASSERT_EQ(got.status, 0) << got.err;
  const json made = json::parse(read_file(calibration));
  EXPECT_EQ(made.at("reference"), "load cell 1 of the board, emulated, in the simulated hand");
  EXPECT_EQ(made.at("axes")[2].at("state"), "calibrated") << got.err;
  EXPECT_NEAR(made.at("K")[2][2].get<double>(), 2800, 40) << "N/m";
  EXPECT_NEAR(made.at("lag_s").at("value").get<double>(), 0, 0.01)
      << "the board's times are on the frames' clock, and this camera has no latency";

  const Outcome checked = check_scale(board);
  if (checked.out.empty()) GTEST_SKIP() << kTooSlow;
  EXPECT_EQ(checked.status, 0) << checked.out << checked.err;
  EXPECT_NE(checked.out.find("fine   scale"), std::string::npos) << checked.out << checked.err;
  EXPECT_EQ(checked.out.find("OFF"), std::string::npos) << checked.out;

  // A cell that shows a tenth more than it feels is found.
  board.order("cell 1 gain 1.1");
  const Outcome more = check_scale(board);
  if (more.out.empty()) GTEST_SKIP() << kTooSlow;
  EXPECT_EQ(more.status, 1) << more.out << more.err;
  EXPECT_NE(more.out.find("OFF    scale"), std::string::npos) << more.out;
}

/// Until so many lines have come; false if they end.
bool wait_for_lines(int fd, std::ptrdiff_t count) {
  char buffer[4096];
  while (count > 0) {
    const ssize_t n = ::read(fd, buffer, sizeof buffer);
    if (n <= 0) return false;
    count -= std::count(buffer, buffer + n, '\n');
  }
  return true;
}

TEST_F(Newtons, TheLightStaysOnForAsLongAsTheHandsDoNot) {
  make_sensor();
  BoardProcess board(folder, {"--cell", "1=0"});
  int events[2];
  ASSERT_EQ(::pipe2(events, 0), 0);  // the program inherits where it writes
  const UniqueFd read_end(events[0]);
  UniqueFd write_end(events[1]);
  // The scenario's hand moves the platform all the time.
  Bridge check({"check", "--sensor", sensor, "--source", "sim:" + scenario, "--board", board.port(),
                "--at", "0,0,6", "--direction", "0,0,-1", "--events", std::to_string(events[1])});
  write_end.reset();
  EXPECT_GT(board.next_light(), 0);
  // Ten or so a second: longer than the five seconds that the board waits for its host.
  constexpr std::ptrdiff_t kLines = 130;
  ASSERT_TRUE(wait_for_lines(read_end.get(), kLines)) << check.err();
  EXPECT_FALSE(board.light_changed());
  check.signal(SIGINT);
  EXPECT_EQ(check.finish().status, 1);
  EXPECT_EQ(board.next_light(), 0);
}

}  // namespace
}  // namespace tagwrench::test
