// `tagwrench tags`: what it refuses, in one line and with nothing written, and what it takes from a
// sensor.yaml.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <iterator>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class TagsInput : public testing::Test {
 protected:
  Outcome tags(std::vector<std::string> options, const std::string& out = "sheet.pdf") {
    options.insert(options.begin(), {"tags", "--out", temporary_ / out});
    return run_bridge(options);
  }
  void expect_refused(const Outcome& outcome, const std::vector<std::string>& parts) {
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
    for (const std::string& part : parts) {
      EXPECT_NE(outcome.err.find(part), std::string::npos)
          << "no '" << part << "' in: " << outcome.err;
    }
    EXPECT_EQ(files(), 0) << outcome.err;
  }
  std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(temporary_.path()), {});
  }

  TemporaryFolder temporary_;
};

TEST_F(TagsInput, DefaultSheetIsWrittenAndOnlyPeopleAreTold) {
  const Outcome outcome = tags({});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("50.0 mm"), std::string::npos);
  EXPECT_EQ(files(), 1);
}

TEST_F(TagsInput, UnknownNamesAreRefusedWithWhatThereIs) {
  expect_refused(tags({"--family", "aruco_9x9"}), {"--family", "aruco_9x9", "grid_10x10"});
  expect_refused(tags({"--paper", "a5"}), {"--paper", "a5", "letter"});
  expect_refused(tags({"--board", "dots"}), {"dots", "charuco:COLUMNSxROWS"});
  expect_refused(tags({"--board", "charuco", "--dictionary", "4x4"}), {"--dictionary", "4x4"});
  expect_refused(tags({}, "sheet.png"), {"sheet.png", ".pdf", ".svg"});
}

TEST_F(TagsInput, NumbersThatCannotBePrintedAreRefused) {
  expect_refused(tags({"--ids", "5,1024"}), {"1024", "aruco_original", "0 to 1023"});
  expect_refused(tags({"--ids", "5,two"}), {"--ids"});
  expect_refused(tags({"--size-mm", "0"}), {"--size-mm"});
  expect_refused(tags({"--size-mm", "nan"}), {"--size-mm"});
  expect_refused(tags({"--size-mm", "1e-300"}), {"--size-mm", "0.1 to 1000"});
  expect_refused(tags({"--size-mm", "250"}), {"250 mm", "does not fit on a4"});
  expect_refused(tags({"--border-mm=-1"}), {"--border-mm"});
  expect_refused(tags({"--copies", "0"}), {"--copies"});
  expect_refused(tags({"--copies", "100000"}), {"--copies", "do not fit"});
  expect_refused(tags({"--board", "charuco", "--columns", "2"}), {"2 squares"});
  expect_refused(tags({"--board", "charuco", "--marker-mm", "1.3"}), {"smaller"});
  expect_refused(tags({"--board", "checkerboard", "--square-mm", "60"}), {"does not fit"});
}

TEST_F(TagsInput, OptionsThatContradictEachOtherAreRefused) {
  expect_refused(tags({"--board", "charuco", "--ids", "3"}), {"--ids"});
  expect_refused(tags({"--paper-sheet", "--size-mm", "4"}), {"--size-mm"});
  expect_refused(tags({"--columns", "8"}), {"--board"});
}

TEST_F(TagsInput, PlacesThatTakeNoFileAreRefused) {
  expect_refused(tags({}, "no/such/folder/sheet.pdf"), {"no/such/folder", "--out"});
  const Outcome outcome = run_bridge({"tags", "--out", "/proc/sheet.pdf"});
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
  expect_refused(run_bridge({"tags"}), {"--out"});
  ASSERT_EQ(::mkfifo((temporary_ / "pipe.pdf").c_str(), 0600), 0);
  const Outcome pipe = tags({}, "pipe.pdf");
  EXPECT_EQ(pipe.status, 2) << pipe.err;
  EXPECT_NE(pipe.err.find("is not a regular file"), std::string::npos) << pipe.err;
  EXPECT_TRUE(std::filesystem::is_fifo(temporary_ / "pipe.pdf"));
}

TEST_F(TagsInput, CellsFinerThanAPrintersDotsAreWarnedOf) {
  const Outcome fine = tags({"--size-mm", "0.6"});
  EXPECT_EQ(fine.status, 0) << fine.err;
  EXPECT_NE(fine.err.find("finer than most printers"), std::string::npos) << fine.err;
  const Outcome board = tags({"--board", "charuco", "--square-mm", "0.7"});
  EXPECT_EQ(board.status, 0) << board.err;
  EXPECT_NE(board.err.find("finer than most printers"), std::string::npos) << board.err;
  const Outcome usual = tags({});
  EXPECT_EQ(usual.err.find("finer"), std::string::npos) << usual.err;
}

TEST_F(TagsInput, SensorFileSaysWhatToPrintAndOptionsOverruleIt) {
  const std::string frames = temporary_ / "frames";
  ASSERT_EQ(run_bridge({"sim", "--out", frames, "--frames", "1"}).status, 0);
  const std::string sensor = frames + "/sensor.yaml";
  ASSERT_EQ(tags({"--sensor", sensor}, "sensor.svg").status, 0);
  ASSERT_EQ(tags({"--family", "aruco_original", "--ids", "5,2", "--size-mm", "3.8", "--border-mm",
                  "0.35"},
                 "options.svg")
                .status,
            0);
  ASSERT_EQ(tags({"--sensor", sensor, "--size-mm", "4"}, "overruled.svg").status, 0);
  EXPECT_EQ(read_file(temporary_ / "sensor.svg"), read_file(temporary_ / "options.svg"));
  EXPECT_NE(read_file(temporary_ / "sensor.svg"), read_file(temporary_ / "overruled.svg"));
  const Outcome missing = tags({"--sensor", temporary_ / "none.yaml"}, "x.pdf");
  EXPECT_EQ(missing.status, 2);
  EXPECT_NE(missing.err.find("none.yaml"), std::string::npos) << missing.err;
}

TEST_F(TagsInput, HardwareFileSaysWhatToPrintAndOptionsOverruleIt) {
  const std::string text = read_file(TAGWRENCH_SENSORS "/paper.yaml");
  const std::string ids = "ids: [5, 2]", size = "tag_size_mm: 3.8", border = "border_mm: 0.35";
  const std::string family = "family: aruco_original";
  const auto with = [&](const std::string& from, const std::string& to, std::string in) {
    const std::size_t at = in.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return in.replace(at, from.size(), to);
  };
  const std::filesystem::path sensors = temporary_ / "sensors";
  std::filesystem::create_directories(sensors);
  std::filesystem::create_symlink(TAGWRENCH_SENSORS "/../cameras", temporary_ / "cameras");
  const std::string file = sensors / "mine.yaml";
  std::string mine = with(ids, "ids: [7, 3]", with(size, "tag_size_mm: 3.6", text));
  mine = with(border, "border_mm: 0.4", with(family, "family: aruco_4x4_50", mine));
  write_file(file, mine);
  const auto same = [&](const Outcome& outcome, const std::vector<std::string>& options) {
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    ASSERT_EQ(tags(options, "options.svg").status, 0);
    EXPECT_TRUE(read_file(temporary_ / "hardware.svg") == read_file(temporary_ / "options.svg"));
  };
  const std::string out = "hardware.svg";
  same(tags({"--hardware", file}, out),
       {"--family", "aruco_4x4_50", "--ids", "7,3", "--size-mm", "3.6", "--border-mm", "0.4"});
  same(tags({"--hardware", file, "--ids", "9"}, out),
       {"--family", "aruco_4x4_50", "--ids", "9", "--size-mm", "3.6", "--border-mm", "0.4"});
}

TEST_F(TagsInput, HardwareThatCannotBeBuiltHasNoTags) {
  expect_refused(tags({"--hardware", TAGWRENCH_SENSORS "/none.yaml"}), {"none.yaml"});
  expect_refused(tags({"--hardware", TAGWRENCH_SENSORS "/paper.yaml", "--sensor", "x.yaml"}),
                 {"--sensor", "--hardware"});
}

}  // namespace
}  // namespace tagwrench::test
