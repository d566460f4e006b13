// A Trial as a CSV file that people and spreadsheets can read, and back.
//
//   # tagwrench-data-1
//   # name: the trial's name
//   # held: true                     only where the reference is what hangs there
//   kind,t_s,step,x_m,...,rz_rad,sigma_x_m,...,predicted_Fx_N,...,predicted_sigma_Fx_N,...,
//        Fx_N,...,Mz_Nm,sigma_Fx_N,...,sigma_Mz_Nm
//   reading,0.04,0,1.2e-05,...       features; the reference's fields are empty
//   reference,0.05,,,...,0.21,...    the reverse
//
// Rows are in order of time. Columns of what is not known (step, sigmas, predictions) are left out
// as a whole; the predictions of one reading may be empty.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench::study {

// What an analysis works on: what a sensor read, and what a reference felt meanwhile.

/// Readings and reference have their own times on one clock (s); both grow. SI units.
struct Trial {
  std::string name;
  std::string file;               ///< it was read from, for messages; empty: none
  std::string sensor;             ///< which: the same text for the same one; empty: not known
  Eigen::VectorXd time;           ///< n, s
  Eigen::MatrixXd features;       ///< n x p: displacement (p = 6; m, rad), or whatever a CSV held
  Eigen::MatrixXd feature_sigma;  ///< n x p, one standard deviation; 0 x 0: not known
  std::vector<std::string> feature_names;  ///< p
  Eigen::VectorXd reference_time;          ///< m, s
  Eigen::MatrixXd reference;               ///< m x 6, N and N m: force before torque
  Eigen::MatrixXd reference_sigma;         ///< m x 6; 0 x 0: not known
  Eigen::VectorXi
      step;  ///< n: of a calibration plan, counted from 0, -1 between steps; empty: none
  /// n x 6: what a calibration's own fit says of a reading whose step it has not seen, N and N m;
  /// NaN where it says nothing; 0 x 0: none.
  Eigen::MatrixXd predicted;
  Eigen::MatrixXd predicted_sigma;  ///< n x 6, of predicted - reference
  bool held = false;  ///< the reference is what hangs there, not an instrument: it has no lag
};

/// Names of the six numbers of a displacement, with their units.
std::vector<std::string> displacement_names();

/// Whether all columns of readings are of one length, and those of the reference.
bool shapes_fit(const Trial& trial);

/// Throws std::invalid_argument if they are not.
std::string trial_to_csv(const Trial& trial);

/// Throws ConfigError, naming file and line: no such file, numbers missing or not finite, times
/// that do not grow.
Trial read_trial(const std::filesystem::path& file);

/// Whether the file says of itself that it is one of ours.
bool is_trial_file(const std::filesystem::path& file);

// Text in columns, whoever wrote it: rows of fields with their places, for messages.

/// Lines that are empty or begin with # are left out. If no field of the first row is a number, the
/// row is the header.
class DelimitedText {
 public:
  /// `separator` 0: whichever of ; tab , splits the first rows evenly; `skip` rows at the top are
  /// left out unread. Throws ConfigError, naming file and line: unreadable, nothing in it, rows of
  /// different lengths.
  explicit DelimitedText(const std::filesystem::path& file, char separator = 0,
                         std::size_t skip = 0);
  DelimitedText(const DelimitedText&) = delete;  // its fields point into its text

  std::size_t rows() const noexcept { return lines_.size(); }
  const std::vector<std::string>& header() const noexcept { return header_; }
  const std::vector<std::string>& comments() const noexcept { return comments_; }
  std::string_view field(std::size_t row, std::size_t column) const noexcept {
    return fields_[row * columns_ + column];
  }
  static constexpr double kMax = 1e12;  ///< squares and sums of it stay finite

  /// FILE:LINE, for messages.
  std::string place(std::size_t row) const { return fmt::format("{}:{}", name_, lines_[row]); }
  const std::string& name() const noexcept { return name_; }

  /// Throws ConfigError unless it is a number of at most `largest`, either way.
  double number(std::size_t row, std::size_t column, double largest = kMax) const;

  /// Of these rows and columns. Empty fields are NaN if `gaps`, else they throw.
  Eigen::MatrixXd numbers(const std::vector<std::size_t>& rows,
                          const std::vector<std::size_t>& columns, bool gaps = false) const;

  /// Columns, counted from 0, of `3`, `3-8`, `time` or `Fx,Fy,Fz`: numbers count from 1, names are
  /// the header's. Throws ConfigError.
  std::vector<std::size_t> find(std::string_view columns) const;

 private:
  std::string name_, text_;
  std::size_t columns_ = 0;
  std::vector<std::string> header_, comments_;
  std::vector<std::string_view> fields_;
  std::vector<std::size_t> lines_;  ///< of each row, counted from 1
};

/// The one finite number that `text` is but for the space around it.
std::optional<double> parse_number(std::string_view text) noexcept;

// Other people's CSV files -> a Trial, by a description of their columns.

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
  std::vector<std::size_t> axes;        ///< in kWrenchAxes; empty: the next ones in order
  double sign = 1;
};

struct CsvMapping {
  std::filesystem::path readings;
  std::filesystem::path reference;  ///< empty: in the same file, at the same times
  char separator = 0;               ///< 0: found out
  std::size_t skip_lines = 0;       ///< at the top of each file
  std::string reading_time = "1", reference_time = "1";
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
