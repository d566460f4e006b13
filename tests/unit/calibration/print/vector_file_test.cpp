#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "host/calibration/print/sheets.h"
#include "host/core/config_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/calibration/print/printed.h"

namespace tagwrench::test {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(VectorFile, EndingSaysWhichKindItIs) {
  const TemporaryFolder folder;
  const Drawing drawing = tag_sheet(kA4, {});
  write_vector_file(drawing, folder / "sheet.PDF");
  EXPECT_EQ(text_of(folder / "sheet.PDF").rfind("%PDF-", 0), 0u);
  write_vector_file(drawing, folder / "sheet.svg");
  // In points of 1/72 inch, so that every program takes it for an A4 page.
  const std::string svg = text_of(folder / "sheet.svg");
  EXPECT_NE(svg.find("width=\"595.27"), std::string::npos) << svg.substr(0, 300);
  EXPECT_NE(svg.find("pt\""), std::string::npos) << svg.substr(0, 300);
  for (const char* name : {"sheet.png", "sheet", "pdf", ".pdf.txt"}) {
    EXPECT_THROW(write_vector_file(drawing, folder / name), ConfigError) << name;
  }
  EXPECT_EQ(files_in(folder / ""), 2u);
}

TEST(VectorFile, WhatCannotBeWrittenLeavesNothingBehind) {
  const TemporaryFolder folder;
  const Drawing drawing = tag_sheet(kA4, {});
  EXPECT_THROW(write_vector_file(drawing, folder / "no/such/folder/sheet.pdf"), ConfigError);
  std::filesystem::create_directory(folder / "taken.pdf");
  EXPECT_THROW(write_vector_file(drawing, folder / "taken.pdf"), ConfigError);
  EXPECT_EQ(files_in(folder / ""), 1u);
}

TEST(VectorFile, ReplacesAnOlderSheetAsAWhole) {
  const TemporaryFolder folder;
  std::ofstream(folder / "sheet.svg") << "old";
  write_vector_file(tag_sheet(kA4, {}), folder / "sheet.svg");
  EXPECT_EQ(text_of(folder / "sheet.svg").rfind("<?xml", 0), 0u);
  EXPECT_EQ(files_in(folder / ""), 1u);
}

}  // namespace
}  // namespace tagwrench::test
