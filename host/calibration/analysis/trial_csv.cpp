#include "host/calibration/analysis/trial_csv.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "host/core/config_error.h"
#include "host/core/os/text_file.h"
#include "host/core/parse.h"

namespace tagwrench::study {
namespace {

constexpr std::string_view kSeparators = ";\t,";
constexpr std::size_t kRowsToTell = 20;  // the separator by
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

bool is_column_name(std::string_view name) {
  return !name.empty() && name.find_first_of(",;\t\r\n#") == std::string_view::npos;
}

struct Line {
  std::string_view text;
  std::size_t number;
};

std::size_t fields_of(std::string_view line, char separator) {
  return std::count(line.begin(), line.end(), separator) + 1;
}

char separator_of(const std::vector<Line>& lines) {
  const std::size_t rows = std::min(lines.size(), kRowsToTell);
  for (const char separator : kSeparators) {
    const std::size_t fields = fields_of(lines[0].text, separator);
    const bool even = std::all_of(lines.begin(), lines.begin() + rows, [&](const Line& line) {
      return fields_of(line.text, separator) == fields;
    });
    if (fields > 1 && even) return separator;
  }
  // Uneven rows: the most frequent one, so that the row which is wrong can be named.
  return *std::max_element(kSeparators.begin(), kSeparators.end(), [&](char a, char b) {
    return fields_of(lines[0].text, a) < fields_of(lines[0].text, b);
  });
}

std::string without_controls(std::string text, char instead) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, instead);
  return text;
}

std::string shown(std::string_view field) {
  constexpr std::size_t kMax = 40;
  const std::string text = without_controls(std::string(field.substr(0, kMax)), '?');
  return field.size() > kMax ? text + "..." : text;
}

constexpr std::string_view kFormat = "tagwrench-data-1";
constexpr std::array<const char*, 6> kLoads{"Fx_N", "Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm"};
constexpr std::string_view kSigma = "sigma_";
constexpr std::string_view kPredicted = "predicted_";

using Out = std::back_insert_iterator<std::string>;

/// Nothing of a matrix without rows; numbers that are not finite are left empty.
void add_row(Out out, const Eigen::MatrixXd& matrix, Eigen::Index row) {
  for (Eigen::Index i = 0; i < matrix.cols() && matrix.rows() > 0; ++i) {
    *out++ = ',';
    if (std::isfinite(matrix(row, i))) fmt::format_to(out, "{}", matrix(row, i));
  }
}

/// The columns of one kind of row; which columns of the file hold them.
struct Columns {
  std::vector<std::size_t> values, sigmas;
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
    std::vector<std::size_t> readings, references;
    for (std::size_t row = 0; row < text_.rows(); ++row) {
      const std::string_view kind = text_.field(row, 0);
      if (kind != "reading" && kind != "reference")
        throw ConfigError("{}: the first column must be reading or reference", text_.place(row));
      (kind == "reading" ? readings : references).push_back(row);
    }
    trial_.time = times(readings);
    trial_.reference_time = times(references);
    trial_.features = text_.numbers(readings, features_.values);
    trial_.feature_sigma = sigmas(readings, features_.sigmas);
    if (!predictions_.values.empty()) {
      trial_.predicted = text_.numbers(readings, predictions_.values, /*gaps=*/true);
      trial_.predicted_sigma = text_.numbers(readings, predictions_.sigmas, /*gaps=*/true);
    }
    trial_.reference = text_.numbers(references, loads_.values);
    trial_.reference_sigma = sigmas(references, loads_.sigmas);
    if (step_ > 0) {
      trial_.step.resize(readings.size());
      for (std::size_t i = 0; i < readings.size(); ++i) trial_.step[i] = step(readings[i]);
    }
    return std::move(trial_);
  }

 private:
  static const std::filesystem::path& ours(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_regular_file(file, error) && !is_trial_file(file)) {
      throw ConfigError(
          "{}: does not begin with '# {}'; for files of others name their columns, see `tagwrench "
          "analyze --help`",
          file.string(), kFormat);
    }
    return file;
  }

  void find_columns() {
    const std::vector<std::string>& header = text_.header();
    if (header.size() < 2 || header[0] != "kind" || header[1] != "t_s")
      throw ConfigError("{}: the header must begin with kind,t_s", text_.name());
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
        if (!is_column_name(name)) {
          throw ConfigError(
              "{}: column {} of the header has no name, or one with a separator in it; rename it",
              text_.name(), i + 1);
        }
      }
    }
    const auto whole = [](const Columns& c) {
      return c.sigmas.empty() || c.sigmas.size() == c.values.size();
    };
    const std::size_t predictions = predictions_.values.size();
    if ((predictions != 0 && predictions != 6) || predictions_.sigmas.size() != predictions ||
        loads_.values.size() != kLoads.size() || features_.values.empty() || !whole(loads_) ||
        !whole(features_)) {
      throw ConfigError(
          "{}: the header must name features, the six of {}, and all of their sigmas or none",
          text_.name(), fmt::join(kLoads, ","));
    }
    if (!std::ranges::equal(loads_.values, kLoads, {}, [&](std::size_t i) { return header[i]; })) {
      throw ConfigError("{}: the loads must be in the order {}", text_.name(),
                        fmt::join(kLoads, ","));
    }
  }

  Eigen::VectorXd times(const std::vector<std::size_t>& rows) const {
    const Eigen::VectorXd time = text_.numbers(rows, {1});
    for (std::size_t i = 1; i < rows.size(); ++i) {
      if (time[i] <= time[i - 1]) {
        throw ConfigError(
            "{}: time {} s after {} s in the row of the same kind before; times must grow",
            text_.place(rows[i]), time[i], time[i - 1]);
      }
    }
    return time;
  }

  Eigen::MatrixXd sigmas(const std::vector<std::size_t>& rows,
                         const std::vector<std::size_t>& columns) const {
    if (columns.empty()) return {};
    Eigen::MatrixXd matrix = text_.numbers(rows, columns);
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (matrix.row(i).minCoeff() < 0)
        throw ConfigError("{}: a sigma that is negative", text_.place(rows[i]));
    return matrix;
  }

  int step(std::size_t row) const {
    const std::string_view field = text_.field(row, step_);
    const int value = field.empty() ? -1 : parse_whole<int>(field).value_or(-2);
    if (value >= -1) return value;
    throw ConfigError("{}: step must be a number from 0, or -1 between steps", text_.place(row));
  }

  DelimitedText text_;
  Columns features_;
  Columns loads_;
  Columns predictions_;
  std::size_t step_ = 0;
  Trial trial_;
};

}  // namespace

std::optional<double> parse_number(std::string_view text) noexcept {
  text = trimmed(text);
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  const auto value = parse_whole<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

DelimitedText::DelimitedText(const std::filesystem::path& file, char separator, std::size_t skip)
    : name_(file.string()), text_(read_text(file, kMaxBytes)) {
  std::string_view rest = text_;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  std::vector<Line> lines;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (number <= skip || trimmed(line).empty()) continue;
    if (line[0] == '#')
      comments_.emplace_back(trimmed(line.substr(1)));
    else
      lines.push_back({line, number});
  }
  if (lines.empty()) throw ConfigError("{}: no rows in it", name_);
  if (separator == 0) separator = separator_of(lines);

  columns_ = fields_of(lines[0].text, separator);
  if (columns_ < 2) {
    throw ConfigError("{}:{}: only one column when split at '{}'; give the right --separator",
                      name_, lines[0].number,
                      separator == '\t' ? std::string("tab") : std::string(1, separator));
  }
  fields_.reserve(lines.size() * columns_);
  for (const Line& line : lines) {
    const std::size_t count = fields_of(line.text, separator);
    if (count != columns_) {
      throw ConfigError(
          "{}:{}: {} fields where the first row has {}; mend the row, or give the right "
          "--separator",
          name_, line.number, count, columns_);
    }
    for (const std::string_view field : split(line.text, separator))
      fields_.push_back(trimmed(field));
    lines_.push_back(line.number);
  }
  const auto first_end = fields_.begin() + columns_;
  if (std::none_of(fields_.begin(), first_end,
                   [](std::string_view f) { return parse_number(f).has_value(); })) {
    header_.assign(fields_.begin(), first_end);
    fields_.erase(fields_.begin(), first_end);
    lines_.erase(lines_.begin());
  }
  if (lines_.empty()) throw ConfigError("{}: a header, but no rows in it", name_);
}

double DelimitedText::number(std::size_t row, std::size_t column, double largest) const {
  const std::string_view text = field(row, column);
  const std::optional<double> value = parse_number(text);
  if (value && std::abs(*value) <= largest) return *value;
  const std::string which = header_.empty()
                                ? fmt::format("column {}", column + 1)
                                : fmt::format("column {} ({})", column + 1, shown(header_[column]));
  if (text.empty())
    throw ConfigError("{}: {} is empty; leave the row out or fill it in", place(row), which);
  if (value) {
    throw ConfigError(
        "{}: {} is '{}', which no instrument reads (at most {:g}); mend it or leave the row out",
        place(row), which, shown(text), largest);
  }
  const bool comma = text.find(',') != std::string_view::npos;
  throw ConfigError(
      "{}: {} is '{}', which is no finite number; {}", place(row), which, shown(text),
      comma ? "write decimal points, not commas" : "leave the row out, or name other columns");
}

Eigen::MatrixXd DelimitedText::numbers(const std::vector<std::size_t>& rows,
                                       const std::vector<std::size_t>& columns, bool gaps) const {
  Eigen::MatrixXd values(rows.size(), columns.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      values(i, j) = gaps && field(rows[i], columns[j]).empty()
                         ? std::numeric_limits<double>::quiet_NaN()
                         : number(rows[i], columns[j]);
    }
  }
  return values;
}

std::vector<std::size_t> DelimitedText::find(std::string_view columns) const {
  std::vector<std::size_t> found;
  const auto numbered = [&](std::string_view text) -> std::size_t {
    const auto number = parse_whole<std::size_t>(text);
    if (number && (*number < 1 || *number > columns_))
      throw ConfigError("{}: no column {}; it has 1 to {}", name_, shown(text), columns_);
    return number.value_or(0);
  };
  for (const std::string_view part : split(columns, ',')) {
    const std::string_view one = trimmed(part);
    if (one.empty()) continue;
    const auto named = std::find(header_.begin(), header_.end(), one);
    if (named != header_.end()) {
      found.push_back(named - header_.begin());
      continue;
    }
    const std::size_t dash = one.find('-');
    const std::size_t first = numbered(one.substr(0, dash));
    const std::size_t last =
        dash == std::string_view::npos ? first : numbered(one.substr(dash + 1));
    if (first == 0 || last < first) {
      throw ConfigError("{}: no column '{}'; name columns by number from 1 ('3-8'){}", name_,
                        shown(one), header_.empty() ? "" : " or as its header does");
    }
    for (std::size_t i = first; i <= last; ++i) found.push_back(i - 1);
  }
  if (found.empty()) throw ConfigError("{}: no columns named", name_);
  return found;
}

std::vector<std::string> displacement_names() {
  return {"x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"};
}

bool shapes_fit(const Trial& trial) {
  const Eigen::Index n = trial.time.size(), m = trial.reference_time.size();
  const auto p = static_cast<Eigen::Index>(trial.feature_names.size());
  const auto fits = [](const Eigen::MatrixXd& matrix, Eigen::Index rows, Eigen::Index columns) {
    return matrix.rows() == rows && matrix.cols() == columns;
  };
  const auto fits_if_any = [&](const Eigen::MatrixXd& matrix, Eigen::Index rows,
                               Eigen::Index columns) {
    return matrix.size() == 0 || fits(matrix, rows, columns);
  };
  return fits(trial.features, n, p) && fits(trial.reference, m, 6) &&
         fits_if_any(trial.feature_sigma, n, p) && fits_if_any(trial.reference_sigma, m, 6) &&
         (trial.step.size() == 0 || trial.step.size() == n) && fits_if_any(trial.predicted, n, 6) &&
         trial.predicted.size() == trial.predicted_sigma.size();
}

std::string trial_to_csv(const Trial& trial) {
  if (!shapes_fit(trial))
    throw std::invalid_argument("a trial whose columns are not of one length");
  for (const std::string& name : trial.feature_names)
    if (!is_column_name(name))
      throw std::invalid_argument("a feature's name that cannot be a CSV column: " + name);
  std::string text = fmt::format("# {}\n# name: {}\n", kFormat, without_controls(trial.name, ' '));
  if (!trial.sensor.empty())
    text += fmt::format("# sensor: {}\n", without_controls(trial.sensor, ' '));
  if (trial.held) text += "# held: true\n";
  const bool steps = trial.step.size() > 0;
  std::string features = steps ? ",step" : "";
  std::string loads;
  const auto add_names = [](std::string& to, bool there, std::string_view prefix,
                            const auto& names) {
    for (std::size_t i = 0; there && i < names.size(); ++i)
      to += fmt::format(",{}{}", prefix, names[i]);
  };
  const bool predictions = trial.predicted.size() > 0;
  add_names(features, true, "", trial.feature_names);
  add_names(features, trial.feature_sigma.size() > 0, kSigma, trial.feature_names);
  add_names(features, predictions, kPredicted, kLoads);
  add_names(features, predictions, fmt::format("{}{}", kPredicted, kSigma), kLoads);
  add_names(loads, true, "", kLoads);
  add_names(loads, trial.reference_sigma.size() > 0, kSigma, kLoads);
  text += "kind,t_s" + features + loads + '\n';

  const auto out = std::back_inserter(text);
  const std::string no_features(std::count(features.begin(), features.end(), ','), ',');
  const std::string no_loads(std::count(loads.begin(), loads.end(), ','), ',');
  Eigen::Index reading = 0, reference = 0;
  while (reading < trial.time.size() || reference < trial.reference_time.size()) {
    const bool reads =
        reference == trial.reference_time.size() ||
        (reading < trial.time.size() && trial.time[reading] <= trial.reference_time[reference]);
    if (reads) {
      fmt::format_to(out, "reading,{}", trial.time[reading]);
      if (steps) fmt::format_to(out, ",{}", trial.step[reading]);
      add_row(out, trial.features, reading);
      add_row(out, trial.feature_sigma, reading);
      add_row(out, trial.predicted, reading);
      add_row(out, trial.predicted_sigma, reading);
      text += no_loads;
      ++reading;
    } else {
      fmt::format_to(out, "reference,{}", trial.reference_time[reference]);
      text += no_features;
      add_row(out, trial.reference, reference);
      add_row(out, trial.reference_sigma, reference);
      ++reference;
    }
    text += '\n';
  }
  return text;
}

Trial read_trial(const std::filesystem::path& file) { return TrialReader(file).read(); }

bool is_trial_file(const std::filesystem::path& file) {
  std::error_code error;  // a pipe would be waited for
  std::ifstream in;
  if (std::filesystem::is_regular_file(file, error)) in.open(file);
  std::string line;
  return std::getline(in, line) && line.starts_with("# " + std::string(kFormat));
}

}  // namespace tagwrench::study
