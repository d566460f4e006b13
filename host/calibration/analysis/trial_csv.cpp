#include "host/calibration/analysis/trial_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "host/calibration/analysis/delimited.h"
#include "host/core/config_error.h"

namespace tagwrench::study {
namespace {

constexpr std::string_view kFormat = "tagwrench-data-1";
constexpr std::array<const char*, 6> kLoads{"Fx_N", "Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm"};
constexpr std::string_view kSigma = "sigma_";
constexpr std::string_view kPredicted = "predicted_";

void check_shapes(const Trial& trial) {
  const auto n = trial.time.size();
  const auto m = trial.reference_time.size();
  const auto p = static_cast<Eigen::Index>(trial.feature_names.size());
  const auto fits = [](const Eigen::MatrixXd& matrix, Eigen::Index rows, Eigen::Index columns) {
    return matrix.rows() == rows && matrix.cols() == columns;
  };
  if (!fits(trial.features, n, p) || !fits(trial.reference, m, 6) ||
      (trial.feature_sigma.size() > 0 && !fits(trial.feature_sigma, n, p)) ||
      (trial.reference_sigma.size() > 0 && !fits(trial.reference_sigma, m, 6)) ||
      (trial.step.size() > 0 && trial.step.size() != n) ||
      (trial.predicted.size() > 0 &&
       (!fits(trial.predicted, n, 6) || !fits(trial.predicted_sigma, n, 6))))
    throw std::invalid_argument("a trial whose columns are not of one length");
  for (const std::string& name : trial.feature_names) {
    if (name.empty() || name.find_first_of(",;\t\r\n#") != std::string::npos)
      throw std::invalid_argument("a feature's name that cannot be a CSV column: " + name);
  }
}

std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  }
  return text;
}

using Out = std::back_insert_iterator<std::string>;

/// Numbers that are not finite are left empty.
void add_row(Out out, const Eigen::MatrixXd& matrix, Eigen::Index row) {
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) {
    if (std::isfinite(matrix(row, i))) {
      fmt::format_to(out, ",{}", matrix(row, i));
    } else {
      fmt::format_to(out, ",");
    }
  }
}

/// The columns of one kind of row; which columns of the file hold them.
struct Columns {
  std::vector<std::size_t> values;
  std::vector<std::size_t> sigmas;
};

class TrialReader {
 public:
  explicit TrialReader(const std::filesystem::path& file) : text_(ours(file), ',') {
    trial_.name = file.stem().stem().string();
    trial_.file = file.string();
    for (const std::string& comment : text_.comments()) {
      if (comment.starts_with("name: ")) trial_.name = comment.substr(6);
      if (comment.starts_with("sensor: ")) trial_.sensor = comment.substr(8);
      if (comment == "held: true") trial_.held = true;
    }
    find_columns();
  }

  Trial read() {
    std::vector<std::size_t> readings;
    std::vector<std::size_t> references;
    for (std::size_t row = 0; row < text_.rows(); ++row) {
      const std::string_view kind = text_.field(row, 0);
      if (kind != "reading" && kind != "reference") {
        throw ConfigError(
            fmt::format("{}: the first column must be reading or reference", text_.place(row)));
      }
      (kind == "reading" ? readings : references).push_back(row);
    }
    trial_.time = times(readings);
    trial_.reference_time = times(references);
    trial_.features = numbers(readings, features_.values);
    trial_.feature_sigma = sigmas(readings, features_.sigmas);
    if (!predictions_.values.empty()) {
      trial_.predicted = optional_numbers(readings, predictions_.values);
      trial_.predicted_sigma = optional_numbers(readings, predictions_.sigmas);
    }
    trial_.reference = numbers(references, loads_.values);
    trial_.reference_sigma = sigmas(references, loads_.sigmas);
    if (step_ > 0) {
      trial_.step.resize(static_cast<Eigen::Index>(readings.size()));
      for (std::size_t i = 0; i < readings.size(); ++i)
        trial_.step[static_cast<Eigen::Index>(i)] = step(readings[i]);
    }
    return std::move(trial_);
  }

 private:
  static const std::filesystem::path& ours(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_regular_file(file, error) && !is_trial_file(file)) {
      throw ConfigError(fmt::format(
          "{}: does not begin with '# {}'; for files of others name their columns, see `tagwrench "
          "analyze --help`",
          file.string(), kFormat));
    }
    return file;
  }

  void find_columns() {
    const std::vector<std::string>& header = text_.header();
    if (header.size() < 2 || header[0] != "kind" || header[1] != "t_s") {
      throw ConfigError(fmt::format("{}: the header must begin with kind,t_s", text_.name()));
    }
    for (std::size_t i = 2; i < header.size(); ++i) {
      std::string name = header[i];
      const bool predicted = name.starts_with(kPredicted);
      if (predicted) name.erase(0, kPredicted.size());
      const bool sigma = name.starts_with(kSigma);
      if (sigma) name.erase(0, kSigma.size());
      const bool load = std::find(kLoads.begin(), kLoads.end(), name) != kLoads.end();
      if (name == "step") {
        step_ = i;
      } else if (predicted) {
        (sigma ? predictions_.sigmas : predictions_.values).push_back(i);
      } else if (sigma) {
        (load ? loads_ : features_).sigmas.push_back(i);
      } else {
        (load ? loads_ : features_).values.push_back(i);
        if (!load) trial_.feature_names.push_back(name);
      }
    }
    const auto whole = [](const Columns& c) {
      return c.sigmas.empty() || c.sigmas.size() == c.values.size();
    };
    const bool predictions_whole =
        predictions_.values.empty()
            ? predictions_.sigmas.empty()
            : predictions_.values.size() == 6 && predictions_.sigmas.size() == 6;
    if (!predictions_whole || loads_.values.size() != kLoads.size() || features_.values.empty() ||
        !whole(loads_) || !whole(features_)) {
      throw ConfigError(
          fmt::format("{}: the header must name features, the six of {}, and all of "
                      "their sigmas or none",
                      text_.name(), fmt::join(kLoads, ",")));
    }
    for (std::size_t k = 0; k < kLoads.size(); ++k) {
      if (header[loads_.values[k]] != kLoads[k]) {
        throw ConfigError(fmt::format("{}: the loads must be in the order {}", text_.name(),
                                      fmt::join(kLoads, ",")));
      }
    }
  }

  Eigen::VectorXd times(const std::vector<std::size_t>& rows) const {
    Eigen::VectorXd time(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      time[at] = text_.number(rows[i], 1);
      if (i > 0 && time[at] <= time[at - 1]) {
        throw ConfigError(
            fmt::format("{}: time {} s after {} s in the row of the same kind before; "
                        "times must grow",
                        text_.place(rows[i]), time[at], time[at - 1]));
      }
    }
    return time;
  }

  Eigen::MatrixXd numbers(const std::vector<std::size_t>& rows,
                          const std::vector<std::size_t>& columns) const {
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()),
                           static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j)
        matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            text_.number(rows[i], columns[j]);
    }
    return matrix;
  }

  Eigen::MatrixXd sigmas(const std::vector<std::size_t>& rows,
                         const std::vector<std::size_t>& columns) const {
    if (columns.empty()) return {};
    Eigen::MatrixXd matrix = numbers(rows, columns);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (matrix.row(static_cast<Eigen::Index>(i)).minCoeff() < 0) {
        throw ConfigError(fmt::format("{}: a sigma that is negative", text_.place(rows[i])));
      }
    }
    return matrix;
  }

  /// NaN where a field is empty.
  Eigen::MatrixXd optional_numbers(const std::vector<std::size_t>& rows,
                                   const std::vector<std::size_t>& columns) const {
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()),
                           static_cast<Eigen::Index>(columns.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j) {
        const bool empty = text_.field(rows[i], columns[j]).empty();
        matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            empty ? std::numeric_limits<double>::quiet_NaN() : text_.number(rows[i], columns[j]);
      }
    }
    return matrix;
  }

  int step(std::size_t row) const {
    const std::string_view field = text_.field(row, step_);
    int value = -1;
    if (field.empty()) return value;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size() || value < -1) {
      throw ConfigError(
          fmt::format("{}: step must be a number from 0, or -1 between steps", text_.place(row)));
    }
    return value;
  }

  DelimitedText text_;
  Columns features_;
  Columns loads_;
  Columns predictions_;
  std::size_t step_ = 0;
  Trial trial_;
};

}  // namespace

std::vector<std::string> displacement_names() {
  return {"x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"};
}

std::string trial_to_csv(const Trial& trial) {
  check_shapes(trial);
  const bool steps = trial.step.size() > 0;
  const bool feature_sigmas = trial.feature_sigma.size() > 0;
  const bool load_sigmas = trial.reference_sigma.size() > 0;
  std::string text = fmt::format("# {}\n# name: {}\n", kFormat, one_line(trial.name));
  if (!trial.sensor.empty()) text += fmt::format("# sensor: {}\n", one_line(trial.sensor));
  if (trial.held) text += "# held: true\n";
  text += "kind,t_s";
  if (steps) text += ",step";
  for (const std::string& name : trial.feature_names) text += "," + name;
  if (feature_sigmas)
    for (const std::string& name : trial.feature_names) text += fmt::format(",{}{}", kSigma, name);
  const bool predictions = trial.predicted.size() > 0;
  if (predictions) {
    for (const char* name : kLoads) text += fmt::format(",{}{}", kPredicted, name);
    for (const char* name : kLoads) text += fmt::format(",{}{}{}", kPredicted, kSigma, name);
  }
  for (const char* name : kLoads) text += fmt::format(",{}", name);
  if (load_sigmas)
    for (const char* name : kLoads) text += fmt::format(",{}{}", kSigma, name);
  text += '\n';

  const auto out = std::back_inserter(text);
  const auto p = trial.feature_names.size();
  const std::string no_features(
      (steps ? 1 : 0) + p * (feature_sigmas ? 2 : 1) + (predictions ? 12 : 0), ',');
  const std::string no_loads(load_sigmas ? 12 : 6, ',');
  Eigen::Index reading = 0;
  Eigen::Index reference = 0;
  while (reading < trial.time.size() || reference < trial.reference_time.size()) {
    const bool reads =
        reference == trial.reference_time.size() ||
        (reading < trial.time.size() && trial.time[reading] <= trial.reference_time[reference]);
    if (reads) {
      fmt::format_to(out, "reading,{}", trial.time[reading]);
      if (steps) fmt::format_to(out, ",{}", trial.step[reading]);
      add_row(out, trial.features, reading);
      if (feature_sigmas) add_row(out, trial.feature_sigma, reading);
      if (predictions) {
        add_row(out, trial.predicted, reading);
        add_row(out, trial.predicted_sigma, reading);
      }
      text += no_loads;
      ++reading;
    } else {
      fmt::format_to(out, "reference,{}", trial.reference_time[reference]);
      text += no_features;
      add_row(out, trial.reference, reference);
      if (load_sigmas) add_row(out, trial.reference_sigma, reference);
      ++reference;
    }
    text += '\n';
  }
  return text;
}

Trial read_trial(const std::filesystem::path& file) { return TrialReader(file).read(); }

bool is_trial_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  return std::getline(in, line) && line.starts_with("# " + std::string(kFormat));
}

}  // namespace tagwrench::study
