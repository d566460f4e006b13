#include "host/board/cell_calibration.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "host/core/config_error.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

TEST(CellCalibrationTest, TwoPointsGiveZeroAndScale) {
  const CellCalibration cell = fit_cell({{0, 8000, 1}, {0.5, 8000 + 0.5 * 9.80665 * 1000, 1}});
  EXPECT_NEAR(cell.newtons_per_count, 1e-3, 1e-12);
  EXPECT_NEAR(cell.zero_counts, 8000, 1e-6);
  EXPECT_NEAR(cell.newtons(9000).value, 1.0, 1e-9);
  EXPECT_EQ(cell.residual_n, 0);
}

TEST(CellCalibrationTest, ACellMountedTheOtherWayRoundHasANegativeScale) {
  const CellCalibration cell = fit_cell({{0, 0, 1}, {1, -9806.65, 1}});
  EXPECT_NEAR(cell.newtons(-9806.65).value, 9.80665, 1e-9);
  EXPECT_GT(cell.newtons(-9806.65).sigma, 0);
}

TEST(CellCalibrationTest, ZeroNeedNotBeAmongTheMasses) {
  const CellCalibration cell = fit_cell({{1, 10'000, 1}, {2, 20'000, 1}});
  EXPECT_NEAR(cell.zero_counts, 0, 1e-6);
}

TEST(CellCalibrationTest, LocalGravityScalesTheForce) {
  const CellCalibration here = fit_cell({{0, 0, 1}, {1, 10'000, 1}}, 9.78);
  EXPECT_NEAR(here.newtons(10'000).value, 9.78, 1e-9);
}

TEST(CellCalibrationTest, MassesThatDoNotSpanAreRefused) {
  EXPECT_THROW(fit_cell({{0, 100, 1}}), ConfigError);
  EXPECT_THROW(fit_cell({{0.5, 100, 1}, {0.5, 101, 1}}), ConfigError);
  EXPECT_THROW(fit_cell({{0, 100, 5}, {0.5, 130, 5}}), ConfigError) << "30 counts of 7 sigma";
  EXPECT_NO_THROW(fit_cell({{0, 100, 5}, {0.5, 400, 5}}));
}

TEST(CellCalibrationTest, StatedSigmaCoversTheErrorOfNoisyCalibrations) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  for (const std::size_t points : {std::size_t{2}, std::size_t{5}}) {
    double squares = 0;
    constexpr int kRuns = 2000;
    for (int run = 0; run < kRuns; ++run) {
      std::vector<CellPoint> seen;
      for (std::size_t i = 0; i < points; ++i) {
        const double mass = static_cast<double>(i) / static_cast<double>(points - 1);
        seen.push_back({mass, 5000 + 9.80665 * mass * 2000 + 20 * normal(random), 20});
      }
      CellCalibration cell = fit_cell(seen);
      const Newtons told = cell.newtons(5000 + 7 * 2000);
      squares += std::pow((told.value - 7) / told.sigma, 2);
    }
    EXPECT_LT(std::sqrt(squares / kRuns), 1.15) << points;
    EXPECT_GT(std::sqrt(squares / kRuns), 0.8) << points;
  }
}

TEST(CellCalibrationTest, PointsOffTheLineAreSaidAndWidenTheSigma) {
  const CellCalibration straight = fit_cell({{0, 0, 1}, {0.5, 5000, 1}, {1, 10'000, 1}});
  const CellCalibration bent = fit_cell({{0, 0, 1}, {0.5, 5300, 1}, {1, 10'000, 1}});
  EXPECT_LT(straight.residual_n, 1e-9);
  EXPECT_GT(bent.residual_n, 0.1);
  EXPECT_GT(bent.newtons_per_count_sigma, 20 * straight.newtons_per_count_sigma);
}

class CellFileTest : public ::testing::Test {
 protected:
  std::string write(const std::string& text) const {
    const fs::path path = folder / "cells.json";
    std::ofstream(path) << text;
    return path.string();
  }
  std::string refusal(const std::string& text) const {
    try {
      load_cells(write(text), "aa");
    } catch (const ConfigError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      return e.what();
    }
    return {};
  }

  test::TemporaryFolder temporary_;
  fs::path folder = temporary_.path();
};

TEST_F(CellFileTest, WhatIsSavedIsLoaded) {
  CellCalibrations cells{};
  cells[2] = fit_cell({{0, 8000, 1}, {0.5, 12'000, 2}});
  cells[2].noise_counts = 4;
  const std::string path = (folder / "deep" / "board-aa.json").string();
  save_cells(path, "aa", cells);
  const CellCalibrations back = load_cells(path, "aa");
  EXPECT_FALSE(back[0].calibrated);
  ASSERT_TRUE(back[2].calibrated);
  EXPECT_EQ(back[2].newtons_per_count, cells[2].newtons_per_count);
  EXPECT_EQ(back[2].zero_counts, cells[2].zero_counts);
  EXPECT_EQ(back[2].noise_counts, 4);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "deep"), {}), 1) << "nothing left behind";
}

TEST_F(CellFileTest, AMissingFileIsNoCalibration) {
  const CellCalibrations cells = load_cells((folder / "none.json").string(), "aa");
  for (const CellCalibration& cell : cells) EXPECT_FALSE(cell.calibrated);
}

TEST_F(CellFileTest, OfAnotherBoardItIsRefused) {
  const std::string text = R"({"format":"tagwrench-cells-1","board":"bb","cells":[]})";
  EXPECT_NE(refusal(text).find("belongs to the board bb"), std::string::npos);
}

TEST_F(CellFileTest, DamagedFilesAreRefusedWithTheirName) {
  const std::string cell =
      R"({"channel":0,"newtons_per_count":1e-3,"newtons_per_count_sigma":1e-6,"zero_counts":1,)"
      R"("zero_sigma_counts":1,"noise_counts":1,"residual_n":0})";
  const auto file = [](const std::string& cells) {
    return R"({"format":"tagwrench-cells-1","board":"aa","cells":[)" + cells + "]}";
  };
  EXPECT_EQ(refusal(file(cell)), "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = cell;
    changed.replace(changed.find(from), from.size(), to);
    return file(changed);
  };
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("{\"format\":\"x\"}"),
        file("7"), with("\"channel\":0", "\"channel\":4"), with("\"channel\":0", "\"channel\":-1"),
        with("\"channel\":0", "\"channel\":0.5"), with("1e-3", "0"), with("1e-3", "\"a\""),
        with("1e-6", "-1"), with("1e-6", "1e308"), with("1e-3", "-1e13"), with("1e-3", "1e999"),
        with("\"residual_n\":0", "\"residual_n\":-5"), file(cell + "," + cell),
        with("\"zero_counts\":1", "\"zero_counts\":NaN"), with("\"noise_counts\":1,", "")}) {
    EXPECT_NE(refusal(text).find("cells.json"), std::string::npos) << text;
  }
}

TEST_F(CellFileTest, TheNameOfAnotherBoardSendsNoControlCodesToATerminal) {
  const std::string said =
      refusal(R"({"format":"tagwrench-cells-1","board":"ffff\n\u001b[2Jx\u00e9","cells":[]})");
  EXPECT_NE(said.find("belongs to the board ffff\\x0a\\x1b[2Jx\u00e9,"), std::string::npos) << said;
  const std::string number = refusal(R"({"format":"tagwrench-cells-1","board":5,"cells":[]})");
  EXPECT_NE(number.find("\"board\""), std::string::npos) << number;
}

TEST_F(CellFileTest, AFileThatCannotBeLookedAtIsSaidAndNotTakenForNone) {
  const fs::path loop = folder / "loop.json";
  fs::create_symlink(loop, loop);
  const fs::path below = folder / "locked" / "cells.json";
  fs::create_directory(folder / "locked");
  fs::permissions(folder / "locked", fs::perms::none);
  EXPECT_THROW(load_cells(loop.string(), "aa"), ConfigError);
  if (::geteuid() != 0) {  // root may look everywhere
    EXPECT_THROW(load_cells(below.string(), "aa"), ConfigError);
  }
  fs::permissions(folder / "locked", fs::perms::owner_all);
  EXPECT_NO_THROW(load_cells(below.string(), "aa"));
}

TEST_F(CellFileTest, AFolderThatCannotBeWrittenIsSaid) {
  EXPECT_THROW(save_cells("/proc/nothing/cells.json", "aa", {}), ConfigError);
}

TEST(CellFilePathTest, FollowsXdg) {
  ::setenv("XDG_CONFIG_HOME", "/some/where", 1);
  EXPECT_EQ(cell_file_path("0a"), "/some/where/tagwrench/board-0a.json");
  ::unsetenv("XDG_CONFIG_HOME");
  ::setenv("HOME", "/home/me", 1);
  EXPECT_EQ(cell_file_path("0a"), "/home/me/.config/tagwrench/board-0a.json");
}

}  // namespace
}  // namespace tagwrench::link
