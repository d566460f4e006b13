// `hardware/export.py` refuses before it writes, in one line.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <regex>

#include "tests/hardware/drawn_sensor.h"

namespace tagwrench::test {
namespace {

const std::string kScript = TAGWRENCH_HARDWARE "/export.py";

class HardwareExport : public testing::Test {
 protected:
  HardwareExport() {
    std::filesystem::create_directory(folder_ / "sensors");
    std::filesystem::create_directory_symlink(TAGWRENCH_HARDWARE "/cameras", folder_ / "cameras");
  }

  /// The published sensor with one number changed.
  std::string changed(const std::string& from, const std::string& to) {
    const std::string paper = read_file(TAGWRENCH_HARDWARE "/sensors/paper.yaml");
    const std::string text = std::regex_replace(paper, std::regex(from), to);
    EXPECT_NE(text, paper) << from;
    write_file(folder_ / "sensors" / "mine.yaml", text);
    return folder_ / "sensors" / "mine.yaml";
  }

  Outcome exported(const std::string& sensor, const std::string& out = "out") {
    return run_tool(
        {TAGWRENCH_HARDWARE "/export.py", "--program", TAGWRENCH_PROGRAM, sensor, folder_ / out});
  }

  void expect_refused(const Outcome& outcome, const std::string& parameter) {
    EXPECT_EQ(outcome.status, 2);
    // A complaint a line; one number can be wrong in two ways.
    EXPECT_GE(lines_in(outcome.err), 1U);
    EXPECT_LE(lines_in(outcome.err), 2U) << outcome.err;
    EXPECT_NE(outcome.err.find(parameter), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::filesystem::directory_iterator entries(folder_.path());
    EXPECT_EQ(std::distance(begin(entries), end(entries)), 2) << "something was written";
  }

  TemporaryFolder folder_;
};

TEST_F(HardwareExport, RefusesTagsThatLeaveTheImage) {
  expect_refused(exported(changed("tag_size_mm: [0-9.]+", "tag_size_mm: 5.5")),
                 "target.lens_distance_mm");
}

TEST_F(HardwareExport, RefusesSpringsThatAreSolidBeforeTheStops) {
  expect_refused(exported(changed("wire_mm: [0-9.]+", "wire_mm: 0.71")), "springs.wire_mm");
}

TEST_F(HardwareExport, RefusesWallsThinnerThanTheNozzleDraws) {
  expect_refused(exported(changed("( wall_mm: )1.75", "$010.5")), "print.wall_mm");
}

TEST_F(HardwareExport, RefusesPartsThatWouldCollide) {
  expect_refused(exported(changed("spacing_mm: .16, 14.", "spacing_mm: [9, 8]")),
                 "springs.spacing_mm");
}

TEST_F(HardwareExport, NamesTheLineOfAWordThatItDoesNotKnow) {
  expect_refused(exported(changed("socket_mm: ", "colour: red\n  socket_mm: ")), "springs.colour");
}

TEST_F(HardwareExport, KnowsItsVariants) { expect_refused(exported("papper"), "paper"); }

TEST_F(HardwareExport, LeavesFoldersAloneThatItDidNotWrite) {
  std::filesystem::create_directory(folder_ / "thesis");
  write_file(folder_ / "thesis" / "chapter.tex", "years of work");
  const Outcome outcome = exported("paper", "thesis");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("no earlier export"), std::string::npos) << outcome.err;
  EXPECT_EQ(read_file(folder_ / "thesis" / "chapter.tex"), "years of work");
}

/// A folder with programs of these names that all do the same.
void fake_programs(const std::filesystem::path& folder, const std::vector<std::string>& names,
                   const std::string& script) {
  std::filesystem::create_directory(folder);
  for (const std::string& name : names) {
    write_file(folder / name, "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(folder / name, std::filesystem::perms::owner_all);
  }
}

TEST_F(HardwareExport, NamesThePackageOfAMissingTool) {
  fake_programs(folder_ / "bin", {"prusa-slicer", "Xvfb"}, "exit 1");
  std::filesystem::create_symlink("/usr/bin/python3", folder_ / "bin" / "python3");
  const Outcome outcome = run_tool({"PATH=" + (folder_ / "bin").string(), "python3", kScript,
                                    "--program", TAGWRENCH_PROGRAM, "paper", folder_ / "out"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err, "hardware: openscad is missing: sudo apt install openscad\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(HardwareExport, KeepsTheEarlierFolderWhereAToolFails) {
  std::filesystem::create_directory(folder_ / "out");
  for (const char* file : {"parts.csv", "parameters.scad"})
    write_file(folder_ / "out" / file, "earlier");
  fake_programs(folder_ / "bin", {"openscad", "prusa-slicer"},
                "echo 'ERROR: no more ink' >&2; exit 3");
  const Outcome outcome = run_tool(
      {"PATH=" + (folder_ / "bin").string() + ":" + std::getenv("PATH"), "python3", kScript,
       "--no-pictures", "--program", TAGWRENCH_PROGRAM, "paper", folder_ / "out"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(lines_in(outcome.err), 1U) << outcome.err;
  EXPECT_NE(outcome.err.find("openscad fails (3): ERROR: no more ink"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(read_file(folder_ / "out" / "parts.csv"), "earlier");
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_EQ(entry.path().string().find("partial"), std::string::npos) << entry.path();
}

TEST_F(HardwareExport, StoppedItLeavesNothing) {
  fake_programs(folder_ / "bin", {"openscad", "prusa-slicer"},
                "touch " + (folder_ / "drawing").string() + "; exec tail -f /dev/null");
  Bridge bridge(
      {"PATH=" + (folder_ / "bin").string() + ":" + std::getenv("PATH"), "python3", kScript,
       "--no-pictures", "--program", TAGWRENCH_PROGRAM, "paper", folder_ / "out"},
      "/dev/null", "/usr/bin/env");
  wait_for_file(folder_ / "drawing");
  bridge.signal(SIGTERM);
  EXPECT_NE(bridge.finish().status, 0);
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_EQ(entry.path().filename().string().find("out"), std::string::npos) << entry.path();
}

}  // namespace
}  // namespace tagwrench::test
