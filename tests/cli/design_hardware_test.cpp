// `tagwrench design` with a file of hardware/sensors: what can be built, what follows from it, and
// what is refused, in one line and with nothing written.
#include <gtest/gtest.h>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class DesignHardware : public testing::Test {
 protected:
  DesignHardware() {
    std::filesystem::create_directories(temporary_ / "sensors");
    std::filesystem::create_directories(temporary_ / "cameras");
    for (const auto& camera :
         std::filesystem::directory_iterator(TAGWRENCH_SENSORS "/../cameras")) {
      std::filesystem::copy(camera, temporary_ / "cameras");
    }
  }

  /// The paper's sensor with `from` replaced.
  std::string changed(const std::string& from, const std::string& to) {
    std::string text = read_file(TAGWRENCH_SENSORS "/paper.yaml");
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return written(text.replace(at, from.size(), to));
  }
  std::string written(const std::string& text) {
    const std::string file = temporary_ / "sensors/mine.yaml";
    write_file(file, text);
    return file;
  }
  /// Of the paper's sensor, as messages write it.
  static std::string line_of(const std::string& key, std::size_t after = 0) {
    const std::string text = read_file(TAGWRENCH_SENSORS "/paper.yaml");
    std::string line = std::to_string(lines_in(text.substr(0, text.find(key))) + 1 + after);
    return line.insert(0, 1, ':');
  }
  void expect_refused(const std::string& file, const std::vector<std::string>& parts) {
    const std::string folder = temporary_ / "out";
    for (const auto& arguments : std::vector<std::vector<std::string>>{
             {"design", "--check", file}, {"design", "--hardware", file, "--export", folder}}) {
      const Outcome outcome = run_bridge(arguments);
      EXPECT_EQ(outcome.status, 2) << outcome.err;
      const std::string& said = outcome.err + outcome.out;
      // The check alone lists all that is in the way.
      const bool one = arguments[1] != "--check";
      EXPECT_TRUE(lines_in(said) == 1 || !one) << said;
      for (const std::string& part : parts)
        EXPECT_NE(said.find(part), std::string::npos) << "no '" << part << "' in: " << said;
      EXPECT_FALSE(std::filesystem::exists(folder));
    }
  }

  TemporaryFolder temporary_;
};

TEST_F(DesignHardware, EveryShippedSensorCanBeBuilt) {
  for (const auto& file : std::filesystem::directory_iterator(TAGWRENCH_SENSORS)) {
    const Outcome outcome = run_bridge({"design", "--check", file.path()});
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find("can be built"), std::string::npos) << outcome.out;
    EXPECT_EQ(lines_in(outcome.out), 1u) << outcome.out;
  }
}

TEST_F(DesignHardware, FilesThatCannotBeReadAreRefused) {
  expect_refused(temporary_ / "none.yaml", {"none.yaml"});
  expect_refused(temporary_.path(), {temporary_.path()});
  expect_refused(written("name: [mine\n"), {"mine.yaml"});
  expect_refused(written(""), {"mine.yaml"});
}

TEST_F(DesignHardware, KeysAreNamedWithTheirLine) {
  expect_refused(changed("tag_size_mm: 3.8", "tag_size_mm: 3.8\n  colour: red"),
                 {"target.colour", line_of("tag_size_mm", 1)});
  expect_refused(changed("free_length_mm: 25.4", "free_length_mm: long"),
                 {"springs.free_length_mm", line_of("free_length_mm")});
  expect_refused(changed("wall_mm: 1.75, ", ""), {"print.wall_mm"});
  expect_refused(changed("ids: [5, 2]", "ids: [5, 1024]"), {"target.ids", "1024", line_of("ids:")});
  expect_refused(changed("family: aruco_original", "family: qr"),
                 {"target.family", "qr", line_of("family:")});
}

TEST_F(DesignHardware, CameraComesFromItsFolder) {
  expect_refused(changed("camera: d7004g14", "camera: none"), {"cameras/none.yaml"});
  expect_refused(changed("camera: d7004g14", "camera: ../secret"), {"camera", "../secret"});
  const std::string camera = temporary_ / "cameras/d7004g14.yaml";
  write_file(camera, read_file(camera) + "shutter: rolling\n");
  expect_refused(changed("about: the", "about: The"), {"d7004g14.yaml", "shutter"});
}

TEST_F(DesignHardware, WhatCannotBeBuiltIsNamedByItsParameter) {
  expect_refused(changed("lens_distance_mm: 21", "lens_distance_mm: 6"), {"target."});
  expect_refused(changed("wall_mm: 1.75", "wall_mm: 0.3"), {"print.wall_mm"});
}

TEST_F(DesignHardware, CheckNamesEveryParameterThatIsInTheWay) {
  std::string text = read_file(TAGWRENCH_SENSORS "/paper.yaml");
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"wall_mm: 1.75", "wall_mm: 0.3"},
        {"z_mm: 1.2", "z_mm: 12"}}) {
    text.replace(text.find(from), from.size(), to);
  }
  const Outcome outcome = run_bridge({"design", "--check", written(text)});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.out.find("print.wall_mm"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("stops.z_mm"), std::string::npos) << outcome.out;
}

TEST_F(DesignHardware, ExportedScenarioRunsWhateverTheFileIsCalled) {
  const std::string folder = temporary_ / "a # b: 'c'";
  std::filesystem::create_directories(folder + "/sensors");
  std::filesystem::copy(temporary_ / "cameras", folder + "/cameras");
  const std::string file = folder + "/sensors/mine.yaml";
  write_file(file, read_file(TAGWRENCH_SENSORS "/paper.yaml"));
  const Outcome outcome = run_bridge({"design", "--hardware", file, "--export", folder});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Outcome run = run_bridge({"run", "--sensor", folder + "/sensor.yaml", "--source",
                                  "sim:" + folder + "/scenario.yaml", "--fast", "--frames", "30",
                                  "--output", "jsonl:-"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("\"ok\""), std::string::npos) << run.out;
}

TEST_F(DesignHardware, ExportGoesOnlyWhereItCanBeWritten) {
  const std::string paper = TAGWRENCH_SENSORS "/paper.yaml";
  write_file(temporary_ / "file", "mine");
  for (const std::string& folder :
       {std::string("/proc/tagwrench"), (temporary_ / "file/inside").string()}) {
    const Outcome outcome = run_bridge({"design", "--hardware", paper, "--export", folder});
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(folder), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(read_file(temporary_ / "file"), "mine");
  const Outcome alone = run_bridge({"design", "--export", temporary_ / "out"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_NE(alone.err.find("--hardware"), std::string::npos) << alone.err;
}

TEST_F(DesignHardware, ExportReplacesWhatHasBeenChangedOnlyWhenForced) {
  const std::string paper = TAGWRENCH_SENSORS "/paper.yaml";
  const std::string folder = temporary_ / "out";
  const std::vector<std::string> again{"design", "--hardware", paper, "--export", folder};
  ASSERT_EQ(run_bridge(again).status, 0);
  EXPECT_EQ(run_bridge(again).status, 0) << "what is the same may be written again";
  for (const char* name : {"sensor.yaml", "plan.yaml"}) {
    const std::string file = folder + "/" + name;
    const std::string drawn = read_file(file);
    const std::string mine = drawn + "# measured\n";
    write_file(file, mine);
    std::filesystem::remove(folder + "/parameters.scad");
    const Outcome refused = run_bridge(again);
    EXPECT_EQ(refused.status, 2) << refused.err;
    EXPECT_EQ(lines_in(refused.err), 1u) << refused.err;
    EXPECT_NE(refused.err.find(file + ": is there already"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
    EXPECT_EQ(read_file(file), mine);
    EXPECT_FALSE(std::filesystem::exists(folder + "/parameters.scad")) << "nothing is written";
    const Outcome forced =
        run_bridge({"design", "--hardware", paper, "--export", folder, "--force"});
    EXPECT_EQ(forced.status, 0) << forced.err;
    EXPECT_EQ(read_file(file), drawn);
  }
  const Outcome alone = run_bridge({"design", "--hardware", paper, "--force"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_NE(alone.err.find("--export"), std::string::npos) << alone.err;
}

TEST_F(DesignHardware, DrawingHasTheTagsAsTheyArePrinted) {
  const std::string folder = temporary_ / "out";
  ASSERT_EQ(
      run_bridge({"design", "--hardware", TAGWRENCH_SENSORS "/paper.yaml", "--export", folder})
          .status,
      0);
  const std::string drawing = read_file(folder + "/parameters.scad");
  EXPECT_NE(drawing.find("\ntag_ids = [5, 2];\n"), std::string::npos);
  // The original ArUco code writes ids in rows of five bits, two of which count: 00 is 10000, 01 is
  // 10111, 10 is 01001 and 11 is 01110 (Garrido-Jurado et al. 2014; OpenCV's DICT_ARUCO_ORIGINAL).
  const std::string zeros = "\"0000000\", \"0100000\", \"0100000\", \"0100000\", ";
  EXPECT_NE(drawing.find("\ntag_bits = [[" + zeros + "\"0101110\", \"0101110\", \"0000000\"], [" +
                         zeros + "\"0100000\", \"0010010\", \"0000000\"]];\n"),
            std::string::npos)
      << drawing;
}

}  // namespace
}  // namespace tagwrench::test
