#include "tests/support/paper_recording.h"

#include <cstdlib>
#include <string>

#include "host/calibration/analysis/trial_csv.h"

namespace tagwrench::test {
namespace {

constexpr std::size_t kSettling = 20;  // readings

study::CsvMapping without_features(const std::filesystem::path& recording) {
  study::CsvMapping mapping;
  mapping.readings = recording / "2019-09-13_120207_arucotagData.csv";
  mapping.reference = recording / "2019-09-13_120207_optoforceData.csv";
  mapping.separator = ';';
  const std::string time_column = "2";
  mapping.reading_time = mapping.reference_time = time_column;
  mapping.skip_readings = kSettling;
  mapping.loads = {study::parse_load_columns("3-8:counts=96.11,95.64,20.92,5425.36,5524.60,8103.25",
                                             "reference")};
  return mapping;
}

study::FeatureColumns features(const std::string& columns) {
  return study::parse_feature_columns(columns, "features");
}

}  // namespace

std::optional<std::filesystem::path> paper_recording() {
  const char* const data = std::getenv("TAGWRENCH_DATA");
  if (data == nullptr) return {};
  const std::filesystem::path folder = std::filesystem::path(data) / "icra2020";
  std::error_code none;
  if (!std::filesystem::is_directory(folder, none)) return {};
  return folder;
}

study::Analysis analyze_mean_of_tags(const std::filesystem::path& recording) {
  study::CsvMapping mapping = without_features(recording);
  mapping.features = {features("15-17:m"), features("18-20:deg:unsmooth=0.2")};
  study::AnalysisOptions options;
  options.smooth = true;
  return study::analyze({study::read_mapped(mapping).trial}, options);
}

study::Analysis analyze_both_tags(const std::filesystem::path& recording) {
  study::CsvMapping mapping = without_features(recording);
  mapping.features = {features("3-8:m"), features("9-11:deg:euler=xyz:unsmooth=0.2"),
                      features("12-14:deg:euler=xyz:unsmooth=0.2")};
  study::AnalysisOptions options;
  options.ridge = 1e-3;
  options.smooth = true;
  return study::analyze({study::read_mapped(mapping).trial}, options);
}

}  // namespace tagwrench::test
