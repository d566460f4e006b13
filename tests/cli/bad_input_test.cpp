// Bad input gets one clear line and the right exit status, and nothing half-written.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

// The program's last words: exactly one line that holds all `parts`.
void expect_refused(const Outcome& outcome, int status, const std::vector<std::string>& parts) {
  EXPECT_EQ(outcome.status, status) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
  EXPECT_EQ(outcome.err.rfind("tagwrench: ", 0), 0u) << outcome.err;
  for (const std::string& part : parts) {
    EXPECT_NE(outcome.err.find(part), std::string::npos)
        << "no '" << part << "' in: " << outcome.err;
  }
}

class BadInput : public testing::Test {
 protected:
  // A rendered folder of `frames` frames with its sensor.yaml.
  std::filesystem::path render(int frames) {
    const std::filesystem::path folder = temporary_ / "frames";
    const Outcome sim = run_bridge({"sim", "--out", folder, "--frames", std::to_string(frames)});
    EXPECT_EQ(sim.status, 0) << sim.err;
    return folder;
  }
  Outcome run_source(const std::string& source) {
    return run_bridge({"run", "--source", source, "--output",
                       "jsonl:" + (temporary_ / "out.jsonl").string(), "--frames", "3"});
  }
  // sensor.yaml of the simulated sensor, edited.
  Outcome run_sensor(const std::string& from, const std::string& to) {
    std::string text = read_file(render(1) / "sensor.yaml");
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << " is not in\n" << text;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    write_file(temporary_ / "edited.yaml", text);
    return run_bridge({"run", "--source", "sim", "--sensor", temporary_ / "edited.yaml", "--output",
                       "jsonl:-", "--frames", "3"});
  }
  bool wrote_output() const { return std::filesystem::exists(temporary_ / "out.jsonl"); }

  TemporaryFolder temporary_;
};

TEST_F(BadInput, NoSuchCamera) {
  expect_refused(run_source("v4l2:/dev/video99"), 2, {"/dev/video99", "no such"});
  EXPECT_FALSE(wrote_output());
}

TEST_F(BadInput, ASensorThatIsAPipeOrADeviceIsNotWaitedFor) {
  const std::string pipe = temporary_ / "sensor.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe, std::string("/dev/zero")}) {
    expect_refused(run_bridge({"run", "--source", "sim", "--sensor", file}), 2,
                   {file, "not a regular file"});
    expect_refused(run_bridge({"run", "--source", "sim", "--profile", file}), 2, {file});
    expect_refused(run_bridge({"run", "--source", "sim:" + file}), 2, {file});
    expect_refused(run_bridge({"run", "--source", "recording:" + file}), 2, {file});
  }
}

TEST_F(BadInput, ASecondDocumentIsNotPassedOver) {
  write_file(temporary_ / "two.yaml", read_file(render(1) / "sensor.yaml") + "---\ncamera: {}\n");
  expect_refused(run_bridge({"run", "--source", "sim", "--sensor", temporary_ / "two.yaml"}), 2,
                 {"two.yaml:", "a second document"});
}

TEST_F(BadInput, AKeyThatATerminalWouldObeyIsSpeltOut) {
  write_file(temporary_ / "evil.yaml", "camera: {width: 640, \"\\e]0;pwned\\a\": 1}\n");
  const Outcome refused =
      run_bridge({"run", "--source", "sim", "--sensor", temporary_ / "evil.yaml"});
  EXPECT_EQ(refused.err.find('\x1b'), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find('\a'), std::string::npos) << refused.err;
}

TEST_F(BadInput, StandardOutputThatIsClosedIsNotWrittenToInVain) {
  const std::string command = "exec \"$0\" run --source sim --frames 3 --output jsonl:- >&-";
  const Outcome closed =
      Bridge({"-c", command, TAGWRENCH_PROGRAM}, "/dev/null", "/bin/sh").finish();
  EXPECT_EQ(closed.status, 1) << closed.err;
  EXPECT_NE(closed.err.find("standard output: is closed"), std::string::npos) << closed.err;
}

TEST_F(BadInput, WhereDescriptorsRunOutThatIsSaid) {
  write_file(temporary_ / "mine.yaml", "name: mine\n");
  for (int limit = 5; limit < 24; ++limit) {
    const std::string command = "ulimit -n " + std::to_string(limit) +
                                "; exec \"$0\" run --source sim --frames 2 --fast --profile " +
                                (temporary_ / "mine.yaml").string() +
                                " --output jsonl:/dev/null --output web:127.0.0.1:0";
    const Outcome outcome =
        Bridge({"-c", command, TAGWRENCH_PROGRAM}, "/dev/null", "/bin/bash").finish();
    EXPECT_EQ(outcome.err.find("Bad file descriptor"), std::string::npos) << limit << outcome.err;
    if (outcome.status == 0) break;
    EXPECT_NE(outcome.err.find("Too many open files"), std::string::npos) << limit << outcome.err;
  }
}

TEST_F(BadInput, NodeThatIsNoCamera) {
  expect_refused(run_source("v4l2:/dev/null"), 2, {"/dev/null"});
  EXPECT_FALSE(wrote_output());
}

TEST_F(BadInput, MalformedCameraSpec) {
  expect_refused(run_source("v4l2:/dev/video0,640by480"), 2, {"640by480"});
  expect_refused(run_source("v4l2:"), 2, {"not a source"});
}

TEST_F(BadInput, UnknownSourceAndOutput) {
  expect_refused(run_source("kinect"), 2, {"kinect", "v4l2:"});
  expect_refused(run_bridge({"run", "--source", "sim", "--output", "xml:-"}), 2,
                 {"xml:-", "jsonl:FILE"});
  expect_refused(run_bridge({"run", "--source", "sim", "--output", "jsonl:-", "--output", "csv:-"}),
                 2, {"standard output"});
}

TEST_F(BadInput, PlaceOfPagesThatIsNone) {
  for (const std::string place : {"[]:8137", ":8137", "127.0.0.1", "127.0.0.1:", "[::1]:70000"})
    expect_refused(run_bridge({"run", "--source", "sim", "--output", "web:" + place}), 2,
                   {"--output web:" + place + ": is no ADDRESS:PORT"});
}

TEST_F(BadInput, UnknownCommandOrOption) {
  expect_refused(run_bridge({"fly"}), 2, {"--help"});
  expect_refused(run_bridge({"run", "--speed", "9"}), 2, {"--speed"});
  expect_refused(run_bridge({"run", "--frames", "-4"}), 2, {"--frames"});
  expect_refused(run_bridge({}), 2, {"subcommand"});
}

TEST_F(BadInput, MissingOrEmptyImageFolder) {
  expect_refused(run_source("images:" + (temporary_ / "nowhere").string()), 2, {"nowhere"});
  std::filesystem::create_directory(temporary_ / "empty");
  expect_refused(run_source("images:" + (temporary_ / "empty").string()), 2, {"empty", "PNG"});
  EXPECT_FALSE(wrote_output());
}

TEST_F(BadInput, MixedSizeImageFolder) {
  const std::filesystem::path folder = render(3);
  cv::imwrite((folder / "000001.png").string(), cv::Mat::zeros(100, 120, CV_8UC1));
  expect_refused(run_source("images:" + folder.string()), 2, {"000001.png", "120x100", "640x480"});
  EXPECT_FALSE(wrote_output());
}

TEST_F(BadInput, ATruncatedPictureIsNamedInOneLine) {
  const std::filesystem::path folder = render(3);
  std::filesystem::resize_file(folder / "000001.png",
                               std::filesystem::file_size(folder / "000001.png") / 2);
  const Outcome ran =
      run_bridge({"run", "--fast", "--source", "images:" + folder.string(), "--output", "jsonl:-"});
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(lines_in(ran.out), 2u);
  EXPECT_NE(ran.err.find("000001.png: is damaged"), std::string::npos) << ran.err;
  std::istringstream lines(ran.err);
  for (std::string line; std::getline(lines, line);)
    EXPECT_EQ(line.rfind("tagwrench: ", 0), 0u) << line;
}

TEST_F(BadInput, FramesOfAnotherSizeThanTheSensor) {
  expect_refused(run_sensor("width: 640", "width: 1280"), 2, {"640x480", "1280x480", "--sensor"});
}

TEST_F(BadInput, SensorFileNamesKeyAndLine) {
  expect_refused(run_sensor("border_mm:", "boarder_mm:"), 2,
                 {"edited.yaml:", "target.boarder_mm", "unknown key"});
  std::filesystem::remove_all(temporary_ / "frames");
  expect_refused(run_sensor("family:", "familly:"), 2,
                 {"edited.yaml:", "target.family", "missing", "familly"});
  std::filesystem::remove_all(temporary_ / "frames");
  expect_refused(run_sensor("tag_size_mm: 3.8", "tag_size_mm: -3.8"), 2,
                 {"edited.yaml:", "tag_size_mm", "must be 0.01 to 10000"});
  std::filesystem::remove_all(temporary_ / "frames");
  expect_refused(run_sensor("tag_size_mm: 3.8", "tag_size_mm: .nan"), 2,
                 {"edited.yaml:", "tag_size_mm", "finite"});
}

TEST_F(BadInput, NoSuchSensorFile) {
  expect_refused(run_bridge({"run", "--source", "sim", "--sensor", "/nonexistent.yaml"}), 2,
                 {"/nonexistent.yaml", "cannot be read"});
}

TEST_F(BadInput, CalibrationOfAnotherSensor) {
  const std::filesystem::path folder = render(1);
  std::string sensor = read_file(folder / "sensor.yaml");
  sensor = sensor.substr(0, sensor.find("\nwrench:")) + "\nwrench: {calibration: other.json}\n";
  write_file(folder / "sensor.yaml", sensor);
  write_file(
      folder / "other.json",
      R"({"format": "tagwrench-calibration-1", "sensor": {"family": "aruco_original", "tag_ids": [7, 8],
                 "tag_size_mm": 3.8, "image_px": [640, 480]}})");
  expect_refused(run_source("images:" + folder.string()), 2,
                 {"other.json", "another sensor", "tag_ids"});
  EXPECT_FALSE(wrote_output());
}

TEST_F(BadInput, BadScenario) {
  write_file(temporary_ / "s.yaml", "seed: 1\nlaser: {}\n");
  expect_refused(run_bridge({"sim", "--scenario", temporary_ / "s.yaml", "--out", temporary_ / "d",
                             "--frames", "3"}),
                 2, {"s.yaml:2", "laser", "unknown key"});
  EXPECT_FALSE(std::filesystem::exists(temporary_ / "d"));
}

TEST_F(BadInput, NoUhidHere) {
  if (std::filesystem::exists("/dev/uhid"))
    GTEST_SKIP() << "this machine has /dev/uhid; the guest tests lack of permission";
  expect_refused(run_bridge({"run", "--source", "sim", "--output", "spacemouse", "--frames", "3"}),
                 2, {"/dev/uhid", "modprobe"});
}

TEST_F(BadInput, DiskFullEndsTheRunWithOneLine) {
  for (const char* kind : {"jsonl", "csv"}) {
    const Outcome o = run_bridge({"run", "--source", "sim", "--fast", "--output",
                                  std::string(kind) + ":/dev/full", "--frames", "50"});
    EXPECT_EQ(o.status, 1) << o.err;
    EXPECT_NE(o.err.find("/dev/full"), std::string::npos) << o.err;
    EXPECT_NE(o.err.find("full"), std::string::npos) << o.err;
  }
}

TEST_F(BadInput, UnwritableFileIsRefusedAtTheStart) {
  expect_refused(run_bridge({"run", "--source", "sim", "--output", "csv:/nonexistent/x.csv"}), 2,
                 {"/nonexistent/x.csv"});
}

TEST_F(BadInput, ClosedPipeEndsTheRunWithOneLine) {
  Bridge bridge({"run", "--source", "sim", "--output", "jsonl:-"});
  ASSERT_TRUE(bridge.wait_for_lines(1));
  bridge.close_stdout();
  const Outcome o = bridge.finish();
  EXPECT_EQ(o.status, 1) << o.err;
  EXPECT_NE(o.err.find("reader"), std::string::npos) << o.err;
}

TEST_F(BadInput, ClosedPipeEndsTheFocusGuideWithOneLine) {
  Bridge guide({"doctor", "--focus", "--source", "sim"});
  ASSERT_TRUE(guide.wait_for_lines(1));
  guide.close_stdout();
  const Outcome o = guide.finish();
  EXPECT_EQ(o.status, 1) << o.err;
  EXPECT_NE(o.err.find("reader"), std::string::npos) << o.err;
}

TEST_F(BadInput, CtrlCAtAnyMomentEndsCleanlyOnAWholeLine) {
  // Signals spread over start-up and run: after 0, 1, 3, 10 and 30 lines of output.
  for (const std::ptrdiff_t lines : {0, 1, 3, 10, 30}) {
    Bridge bridge({"run", "--source", "sim", "--output", "jsonl:-"});
    ASSERT_TRUE(bridge.wait_for_lines(lines));
    bridge.signal(SIGINT);
    const Outcome o = bridge.finish();
    // Before the program has taken charge of signals, Ctrl-C ends it the ordinary way.
    EXPECT_TRUE(o.status == 0 || (lines == 0 && o.status == 128 + SIGINT)) << o.status << o.err;
    EXPECT_TRUE(o.out.empty() || o.out.back() == '\n') << o.out;
  }
}

TEST_F(BadInput, CorruptImagesAreSkippedCountedAndNeverACrash) {
  const std::filesystem::path folder = render(8);
  const std::string whole = read_file(folder / "000004.png");
  write_file(folder / "000004.png", whole.substr(0, whole.size() / 3));
  const Outcome o =
      run_bridge({"run", "--source", "images:" + folder.string(), "--fast", "--output", "jsonl:-"});
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(lines_in(o.out), 7u) << o.out;
  EXPECT_NE(o.out.find("\"seq\":5,"), std::string::npos);
  EXPECT_NE(o.out.find("\"dropped\":1,"), std::string::npos) << o.out;
}

TEST_F(BadInput, SimRefusesToMixItsFramesWithOtherFiles) {
  std::filesystem::create_directory(temporary_ / "d");
  write_file((temporary_ / "d") / "holiday.png", "mine");
  const Outcome o = run_bridge({"sim", "--out", temporary_ / "d", "--frames", "3"});
  expect_refused(o, 2, {"d"});
  EXPECT_EQ(read_file((temporary_ / "d") / "holiday.png"), "mine");
  EXPECT_FALSE(std::filesystem::exists(temporary_ / "d" / "000000.png"));
}

TEST_F(BadInput, ASensorFileThatCannotBeUsedIsNotMistakenForAMissingCamera) {
  expect_refused(run_bridge({"run", "--sensor", "/nonexistent.yaml", "--frames", "3"}), 2,
                 {"/nonexistent.yaml", "cannot be read"});
}

TEST_F(BadInput, ARefusedRunLeavesExistingFilesAlone) {
  write_file(temporary_ / "keep.jsonl", "precious\n");
  const std::string keep = "jsonl:" + (temporary_ / "keep.jsonl").string();
  for (const char* other : {"bogus", "csv:/nonexistent/x.csv"}) {
    const Outcome o = run_bridge({"run", "--source", "sim", "--output", keep, "--output", other});
    EXPECT_EQ(o.status, 2) << o.err;
    EXPECT_EQ(read_file(temporary_ / "keep.jsonl"), "precious\n") << other;
  }
}

TEST_F(BadInput, TwoOutputsCannotShareAFile) {
  const std::string file = (temporary_ / "both").string();
  expect_refused(run_bridge({"run", "--source", "sim", "--output", "jsonl:" + file, "--output",
                             "csv:" + file}),
                 2, {"twice"});
}

TEST_F(BadInput, ADurationThatIsNone) {
  for (const char* seconds : {"0", "-1", "nan", "1e300", "5s"}) {
    expect_refused(run_bridge({"run", "--source", "sim", "--seconds", seconds}), 2, {"--seconds"});
  }
}

TEST_F(BadInput, AClosedStandardErrorDoesNotEndTheRun) {
  Bridge bridge({"run", "--source", "sim", "--output", "jsonl:-", "--frames", "30"});
  bridge.close_stderr();
  const Outcome o = bridge.finish();
  EXPECT_EQ(o.status, 0);
  EXPECT_EQ(lines_in(o.out), 30u);
}

TEST_F(BadInput, ASlowReaderOfAFastRunGetsEveryFrameOnce) {
  Bridge bridge(
      {"run", "--source", "images:" + render(60).string(), "--fast", "--output", "jsonl:-"});
  const Outcome o = bridge.finish_slowly();
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(lines_in(o.out), 60u);
  EXPECT_EQ(o.out.find("\"lost\""), std::string::npos);
}

TEST_F(BadInput, ScenariosBeyondAllMeasureAreRefused) {
  for (const char* text :
       {"mechanics: {mass_g: 1e-300}", "mechanics: {axial_n_per_mm: 1e300}",
        "mechanics: {spring_length_mm: 1e300}", "mechanics: {inertia_g_mm2: [1e-300, 1, 1]}",
        "trajectory: {amplitude: [1e300, 1, 1, 1, 1, 1]}",
        "mechanics: {range: [0, 1, 1, 1, 1, 1]}"}) {
    write_file(temporary_ / "s.yaml", std::string(text) + "\n");
    const Outcome o =
        run_bridge({"run", "--source", "sim:" + (temporary_ / "s.yaml").string(), "--frames", "3"});
    EXPECT_EQ(o.status, 2) << text << o.err;
    EXPECT_NE(o.err.find("s.yaml"), std::string::npos) << o.err;
  }
}

}  // namespace
}  // namespace tagwrench::test
