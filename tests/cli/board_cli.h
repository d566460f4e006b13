// What the tests of `tagwrench board` share.
#pragma once

#include <gtest/gtest.h>

#include <sstream>

#include "bridge.h"
#include "served_board.h"

namespace tagwrench::test {

constexpr const char* kCells =
    R"({"format":"tagwrench-cells-1","board":"0102030405060708","cells":[)"
    R"({"channel":0,"newtons_per_count":0.001,"newtons_per_count_sigma":1e-7,"zero_counts":0,)"
    R"("zero_sigma_counts":1,"noise_counts":2,"residual_n":0},)"
    R"({"channel":1,"newtons_per_count":0.001,"newtons_per_count_sigma":1e-7,"zero_counts":0,)"
    R"("zero_sigma_counts":1,"noise_counts":2,"residual_n":0},)"
    R"({"channel":2,"newtons_per_count":0.001,"newtons_per_count_sigma":1e-7,"zero_counts":0,)"
    R"("zero_sigma_counts":1,"noise_counts":2,"residual_n":0},)"
    R"({"channel":3,"newtons_per_count":0.001,"newtons_per_count_sigma":1e-7,"zero_counts":0,)"
    R"("zero_sigma_counts":1,"noise_counts":2,"residual_n":0}]})";

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

class BoardCliTest : public ::testing::Test {
 protected:
  BoardCliTest() { ::setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1); }

  std::string cells_file() const {
    write_file(folder / "cells.json", kCells);
    return (folder / "cells.json").string();
  }
  TemporaryFolder folder;
};

}  // namespace tagwrench::test
