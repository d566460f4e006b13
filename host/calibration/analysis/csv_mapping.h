// Other people's CSV files -> a Trial, by a description of their columns.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"

namespace tagwrench::study {

/// Columns that hold readings: COLUMNS[:UNIT][:euler[=ORDER]][:unsmooth=WEIGHT].
struct FeatureColumns {
  std::string columns;
  double unit = 1;      ///< SI per number in the file
  char quantity = 0;    ///< 'm' or 'r', rad; 0: not said
  std::string euler;    ///< order of intrinsic rotations, "xyz": three angles become a rotation
                        ///< vector from the first readings; empty: taken as they are
  double unsmooth = 0;  ///< weight w of an exponential smoothing to be undone,
                        ///< raw = (y[i] - (1 - w) y[i-1]) / w; 0: none
};

/// Columns that hold the reference: COLUMNS[:UNIT][:counts=A,B,...][:axes=Fx,...][:negative].
struct LoadColumns {
  std::string columns;
  double unit = 1;                      ///< N or N m per number in the file
  std::vector<double> counts_per_unit;  ///< of each column; empty: 1
  std::vector<std::string> axes;        ///< of kWrenchAxes; empty: the next ones in order
  double sign = 1;
};

struct CsvMapping {
  std::filesystem::path readings;
  std::filesystem::path reference;  ///< empty: in the same file, at the same times
  char separator = 0;               ///< 0: found out
  std::size_t skip_lines = 0;       ///< at the top of each file
  std::string reading_time = "1";
  std::string reference_time = "1";
  double time_unit = 1;  ///< s
  double reference_time_unit = 1;
  std::vector<FeatureColumns> features;
  std::vector<LoadColumns> loads;
  std::size_t skip_readings = 0;  ///< rows, after smoothing has been undone
  std::size_t skip_references = 0;
  std::size_t rest_readings = 10;  ///< rows after those, from which Euler angles count
  std::size_t zero_rows = 0;       ///< of the reference, before any is skipped: their mean is zero
};

struct MappedTrial {
  Trial trial;
  std::vector<std::string> notes;  ///< what was left out, for people
};

/// Throw ConfigError, naming `option`.
FeatureColumns parse_feature_columns(const std::string& text, const std::string& option);
LoadColumns parse_load_columns(const std::string& text, const std::string& option);
double parse_time_unit(const std::string& text, const std::string& option);

/// Rows whose time is that of the row before are left out, and noted. Throws ConfigError, naming
/// file and line: fields missing or not finite, times that run backwards.
MappedTrial read_mapped(const CsvMapping& mapping);

}  // namespace tagwrench::study
