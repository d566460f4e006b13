// `tagwrench run --board` as its users run it, with the real firmware as a process on a
// pseudo-terminal.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bridge.h"

namespace tagwrench::test {
namespace {

const std::string kStill = "trajectory: {motion: rest}\n";

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) out.push_back(field);
  if (!line.empty() && line.back() == ',') out.emplace_back();
  return out;
}

/// Rows of a CSV file as maps of its header.
std::vector<std::map<std::string, std::string>> rows_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = fields_of(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(in, line)) {
    const std::vector<std::string> fields = fields_of(line);
    EXPECT_EQ(fields.size(), header.size()) << line;
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < std::min(fields.size(), header.size()); ++i)
      row[header[i]] = fields[i];
  }
  return rows;
}

/// Level (permille) of the board's last "led TIME LEVEL" line.
std::string last_level(const std::string& said) {
  const std::size_t at = said.rfind("led ");
  if (at == std::string::npos) return "";
  std::istringstream in(said.substr(at));
  std::string word, time, level;
  in >> word >> time >> level;
  return level;
}

class RunBoard : public ::testing::Test {
 protected:
  RunBoard()
      : board({"--port", port(), "--cell", "0=0.5", "--cell", "1=1", "--cell", "2=none"},
              "/dev/null", TAGWRENCH_BOARD_PC) {
    ::setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
    wait_for_file(port());
    write_file(folder / "still.yaml", kStill);
  }

  std::string port() const { return (folder / "port").string(); }
  std::string source() const { return "sim:" + (folder / "still.yaml").string(); }

  /// As if 100,000 counts were a newton on every channel.
  void calibrate_cells() { calibrate_cells(port()); }
  void calibrate_cells(const std::string& of_port) {
    const Outcome info = run_bridge({"board", "info", "--json", "--port", of_port});
    const std::string id = nlohmann::json::parse(info.out)["id"];
    nlohmann::json cells{{"format", "tagwrench-cells-1"}, {"board", id}};
    for (int channel = 0; channel < 4; ++channel) {
      cells["cells"].push_back({{"channel", channel},
                                {"newtons_per_count", 1e-5},
                                {"newtons_per_count_sigma", 0.0},
                                {"zero_counts", 0.0},
                                {"zero_sigma_counts", 0.0},
                                {"noise_counts", 0.0},
                                {"residual_n", 0.0}});
    }
    std::filesystem::create_directory(folder / "tagwrench");
    write_file(folder / "tagwrench" / ("board-" + id + ".json"), cells.dump());
  }

  TemporaryFolder folder;
  Bridge board;
};

TEST_F(RunBoard, IsLitWhileItRunsAndDarkAfterwards) {
  const Outcome run = run_bridge(
      {"run", "--source", source(), "--board", port(), "--output", "csv:-", "--frames", "30"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("does not light this source"), std::string::npos) << run.err;
  ASSERT_TRUE(board.wait_for_message(" 100\n")) << board.err();
  board.signal(SIGTERM);
  const std::string said = board.finish().err;
  EXPECT_EQ(last_level(said), "0") << said;
}

TEST_F(RunBoard, TheDefaultSimulationIsHeldAlthoughTheBoardTakesItsTime) {
  const Outcome run = run_bridge(
      {"run", "--source", "sim", "--board", port(), "--output", "csv:-", "--frames", "40"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find(",ok,"), std::string::npos) << run.err;
}

TEST_F(RunBoard, WhatHasAnotherTimeThanTheBoardIsRefused) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--source", source(), "--fast"},
        std::vector<std::string>{"--source", "images:" + folder.path()}}) {
    std::vector<std::string> all{"run", "--board", port(), "--output", "csv:-"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome run = run_bridge(all);
    EXPECT_EQ(run.status, 2);
    EXPECT_EQ(lines_in(run.err), 1U) << run.err;
    EXPECT_NE(run.err.find("--board"), std::string::npos) << run.err;
  }
  const Outcome cells = run_bridge({"run", "--source", source(), "--cells", "x.json"});
  EXPECT_EQ(cells.status, 2);
  EXPECT_EQ(lines_in(cells.err), 1U) << cells.err;
}

TEST_F(RunBoard, WritesEveryFrameBesideTheLoadCellsOfThatTime) {
  calibrate_cells();
  const std::string file = (folder / "reference.csv").string();
  const Outcome run = run_bridge({"run", "--source", source(), "--board", port(), "--output",
                                  "reference:" + file, "--frames", "40"});
  EXPECT_EQ(run.status, 0) << run.err;
  const auto rows = rows_of(file);
  ASSERT_EQ(rows.size(), 40U);
  std::size_t aligned = 0;
  for (const auto& row : rows) {
    EXPECT_EQ(row.at("cell2_counts"), "") << "not wired: no number, not a zero";
    EXPECT_EQ(row.at("cell2_n"), "");
    if (row.at("cell0_n").empty()) continue;
    ++aligned;
    const double counts = std::stod(row.at("cell0_counts"));
    EXPECT_NEAR(std::stod(row.at("cell0_n")), counts * 1e-5, 1e-4);
    EXPECT_GT(std::stod(row.at("cell0_sigma_n")), 0);
    // The model's cells have the same counts per newton, and the second bears twice the force.
    if (row.at("cell1_n").empty()) continue;
    EXPECT_NEAR(std::stod(row.at("cell1_n")) / std::stod(row.at("cell0_n")), 2, 0.1);
  }
  EXPECT_GE(aligned, 35U) << "all but the last ones, whose cells had not spoken when it ended";
}

TEST_F(RunBoard, TheCameraLatencyPutsTheCellsAtTheTimeOfTheExposure) {
  // Half a second back the cells have spoken about every frame, the last one too; without it, or
  // the other way, the last rows are empty.
  const std::string made = (folder / "made").string();
  ASSERT_EQ(run_bridge({"sim", "--scenario", folder / "still.yaml", "--out", made, "--frames", "1"})
                .status,
            0);
  std::ifstream in(made + "/sensor.yaml");
  std::string sensor{std::istreambuf_iterator<char>(in), {}};
  const std::size_t camera = sensor.find("width:");
  ASSERT_NE(camera, std::string::npos);
  sensor.insert(camera, "latency_ms: 500\n  ");
  write_file(folder / "late.yaml", sensor);
  const std::string file = (folder / "reference.csv").string();
  const Outcome run =
      run_bridge({"run", "--source", source(), "--sensor", folder / "late.yaml", "--board", port(),
                  "--output", "reference:" + file, "--frames", "30"});
  EXPECT_EQ(run.status, 0) << run.err;
  const auto rows = rows_of(file);
  ASSERT_GE(rows.size(),
            30U);  // more where a busy machine was late with a frame, and a row says so
  EXPECT_NE(rows.back().at("cell0_counts"), "");
  EXPECT_NE(rows[25].at("cell1_counts"), "");
}

TEST_F(RunBoard, ABoardThatGoesAwayIsSaidAndTheFramesGoOn) {
  Bridge run(
      {"run", "--source", source(), "--board", port(), "--output", "csv:-", "--seconds", "60"});
  ASSERT_TRUE(run.wait_for_lines(30)) << run.finish().err;
  board.signal(SIGKILL);
  std::filesystem::remove(port());  // its pseudo-terminal may soon be somebody else's
  ASSERT_TRUE(run.wait_for_message("the port is gone")) << run.finish().err;
  ASSERT_TRUE(run.wait_for_lines(60));
  run.signal(SIGINT);
  const Outcome outcome = run.finish();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find(",ok,"), std::string::npos);
}

TEST_F(RunBoard, ALoadCellThatIsThereForGoodContradictsASensorThatFeelsNothing) {
  ASSERT_EQ(run_bridge({"sim", "--scenario", folder / "still.yaml", "--out", folder / "frames",
                        "--frames", "1"})
                .status,
            0);
  const std::filesystem::path sensor = folder / "sensor.yaml";
  // This board's cell swings by half a newton; the platform is left alone.
  const std::string swinging_port = (folder / "swinging").string();
  Bridge swinging({"--port", swinging_port, "--cell", "0=sine:0.5:0.4"}, "/dev/null",
                  TAGWRENCH_BOARD_PC);
  wait_for_file(swinging_port);
  calibrate_cells(swinging_port);
  write_file(sensor, read_file(folder / "frames" / "sensor.yaml") +
                         "  reference: {channel: 0, point_mm: [5, 3, 0], direction: [0, 0, -1]}\n");
  Bridge run({"run", "--source", source(), "--sensor", sensor, "--board", swinging_port, "--output",
              "csv:" + (folder / "out.csv").string(), "--seconds", "60"});
  ASSERT_TRUE(run.wait_for_message("every sample is compared with load cell 0")) << run.err();
  ASSERT_TRUE(run.wait_for_message("against load cell 0 the sensor measures")) << run.err();
  run.signal(SIGINT);
  EXPECT_EQ(run.finish().status, 0);
}

TEST_F(RunBoard, AReferenceWithoutABoardIsRefusedBeforeAnythingIsLit) {
  const Outcome run =
      run_bridge({"run", "--source", source(), "--output", "reference:-", "--frames", "1"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(lines_in(run.err), 1U) << run.err;
  EXPECT_NE(run.err.find("--board"), std::string::npos) << run.err;

  const Outcome wrong = run_bridge({"run", "--source", source(), "--board", port(), "--output",
                                    "reference:/no/such/folder/file", "--frames", "1"});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_EQ(lines_in(wrong.err), 1U) << wrong.err;
  board.signal(SIGTERM);
  EXPECT_EQ(last_level(board.finish().err), "") << "never lit";
}

TEST_F(RunBoard, APortThatIsNotThereIsOneLine) {
  const Outcome run = run_bridge(
      {"run", "--source", source(), "--board", (folder / "nothing").string(), "--output", "csv:-"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(lines_in(run.err), 1U) << run.err;
  EXPECT_NE(run.err.find("nothing"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace tagwrench::test
