// The table as people read it.
#include <array>
#include <sstream>
#include <string>

#include "host/calibration/analysis/analysis.h"
#include "host/core/axis_names.h"
#include "tests/unit/calibration/analysis/analyzed.h"

namespace tagwrench::test {
namespace {

using study::Analysis;

TEST(AnalysisReport, RangesShowFourDigitsOfWhatWasLoaded) {
  Analysis a;
  a.axis[3].range_low = -0.0078312;
  a.axis[3].range_high = 0.0029;
  a.axis[3].full_scale = 0.0078312;
  EXPECT_NE(study::analysis_text(a).find("-0.007831    0.002900  N m"), std::string::npos)
      << study::analysis_text(a);
}

/// The line of one axis.
std::string line_of(const Analysis& analysis, const std::string& axis) {
  std::istringstream text(study::analysis_text(analysis));
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with(axis)) return line;
  }
  return {};
}

TEST(AnalysisReport, RangesOfAllAxesHaveTheirPointsBelowEachOther) {
  Analysis a;
  const std::array scales{40.0, 2.217, 4.7, 0.06, 0.1279, 0.01752};
  for (std::size_t k = 0; k < 6; ++k) {
    a.axis[k].full_scale = scales[k];
    a.axis[k].range_low = -scales[k];
    a.axis[k].range_high = 0.5 * scales[k];
  }
  const std::string first = line_of(a, "Fx");
  for (const char* axis : kWrenchAxes) {
    const std::string line = line_of(a, axis);
    const std::size_t from = line.find('.');
    EXPECT_EQ(from, first.find('.')) << line;
    EXPECT_EQ(line.find('.', from + 1), first.find('.', from + 1)) << line;
  }
  EXPECT_NE(line_of(a, "Mz").find("-0.01752     0.00876  N m"), std::string::npos)
      << line_of(a, "Mz");
}

TEST(AnalysisReport, ColumnsStayApartWhateverTheScore) {
  Analysis a;
  a.axis[0].full_scale = a.axis[0].range_high = 123456;
  a.axis[0].r2_in_sample = 0.9;
  a.axis[0].r2 = -2451.7;
  a.axis[0].rmse = 1.17e-13;
  a.axis[0].rmse_percent = 116439.11;
  a.axis[0].nonlinearity_percent = 111429.33;
  a.axis[0].hysteresis_percent = 3.5;
  a.axis[0].excitation = 1e5;
  a.axis[0].independent = 3.04e-9;
  a.folds.resize(1);
  a.folds[0].r2.fill(-6389.54);
  const std::string text = study::analysis_text(a);
  EXPECT_NE(line_of(a, "Fx").find("0.9000    <-10 "), std::string::npos) << text;
  EXPECT_NE(line_of(a, "Fx").find("  1.17e-13  >1000   >1000   3.50    >1000    <0.1"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("    <-10     <-10"), std::string::npos) << text;
}

}  // namespace
}  // namespace tagwrench::test
