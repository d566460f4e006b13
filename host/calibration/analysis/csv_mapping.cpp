// Other people's CSV files -> a Trial.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/parse.h"

namespace tagwrench::study {
namespace {

struct Unit {
  std::string_view name;
  double si;
};
constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array kFeatureUnits{Unit{"m", 1},   Unit{"mm", 1e-3},   Unit{"um", 1e-6},
                                   Unit{"rad", 1}, Unit{"mrad", 1e-3}, Unit{"deg", kDegree}};
constexpr std::array kLoadUnits{Unit{"N", 1},      Unit{"mN", 1e-3},  Unit{"Nm", 1},
                                Unit{"mNm", 1e-3}, Unit{"Nmm", 1e-3}, Unit{"gf", 9.80665e-3}};
constexpr std::array kTimeUnits{Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}, Unit{"ns", 1e-9}};

// A platform on springs goes no further; numbers that do were written in another unit.
constexpr double kMaxWay = 0.1;      // m
constexpr double kMaxTurn = 2.0;     // rad
constexpr double kMinWeight = 1e-6;  // of a smoothing that can be undone

const Unit* find_unit(std::span<const Unit> units, std::string_view name) {
  const auto at =
      std::find_if(units.begin(), units.end(), [&](const Unit& unit) { return unit.name == name; });
  return at == units.end() ? nullptr : &*at;
}

std::string names(std::span<const Unit> units) {
  std::string text;
  for (const Unit& unit : units) text += (text.empty() ? "" : " ") + std::string(unit.name);
  return text;
}

/// Rows to use, in order, with their times.
struct UsedRows {
  std::vector<std::size_t> row;
  Eigen::VectorXd time;
};

UsedRows rows_in_order(const DelimitedText& text, const std::string& column, double unit,
                       std::size_t skip, std::vector<std::string>& notes) {
  const std::vector<std::size_t> found = text.find(column);
  if (found.size() != 1)
    throw ConfigError("{}: name one column of times, not '{}'", text.name(), column);
  UsedRows rows;
  std::vector<double> times;
  std::size_t repeated = 0;
  double before = 0;
  for (std::size_t row = 0; row < text.rows(); ++row) {
    const double time = text.number(row, found[0], DelimitedText::kMax / unit) * unit;
    if (row > 0 && time < before) {
      throw ConfigError(
          "{}: time runs backwards, {} s after {} s; put the rows in order, or name the right "
          "column of times",
          text.place(row), time, before);
    }
    const bool repeats = row > 0 && time == before;
    before = time;
    if (row < skip) continue;
    if (repeats && !times.empty()) {
      ++repeated;
      continue;
    }
    rows.row.push_back(row);
    times.push_back(time);
  }
  if (repeated > 0) {
    notes.push_back(fmt::format("{}: {} with the time of the row before left out", text.name(),
                                repeated == 1 ? "1 row" : fmt::format("{} rows", repeated)));
  }
  if (times.size() < 2)
    throw ConfigError("{}: fewer than two rows of different times are left", text.name());
  rows.time = Eigen::Map<const Eigen::VectorXd>(times.data(), times.size());
  return rows;
}

/// Of all rows, used or not.
Eigen::MatrixXd all_numbers(const DelimitedText& text, const std::vector<std::size_t>& columns) {
  std::vector<std::size_t> rows(text.rows());
  std::iota(rows.begin(), rows.end(), 0);
  return text.numbers(rows, columns);
}

Eigen::Matrix3d rotation(const std::string& order, const Eigen::Vector3d& angles) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i)
    r = r * Eigen::AngleAxisd(angles[i], Eigen::Vector3d::Unit(order[i] - 'x')).toRotationMatrix();
  return r;
}

/// Rotation vectors from the mean of the first `rest` rows, along the axes of that.
Eigen::MatrixXd rotation_vectors(const std::string& order, const Eigen::MatrixXd& angles,
                                 std::size_t rest) {
  const Eigen::Index count = std::clamp<Eigen::Index>(rest, 1, angles.rows());
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  const auto quaternion = [&](Eigen::Index row) {
    return Eigen::Quaterniond(rotation(order, angles.row(row).transpose()));
  };
  const Eigen::Quaterniond first = quaternion(0);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector4d q = quaternion(i).coeffs();
    sum += q.dot(first.coeffs()) < 0 ? Eigen::Vector4d(-q) : q;
  }
  const Eigen::Quaterniond mean(Eigen::Vector4d(sum.normalized()));
  Eigen::MatrixXd vectors(angles.rows(), 3);
  for (Eigen::Index i = 0; i < angles.rows(); ++i) {
    const Eigen::AngleAxisd turn(mean.conjugate() * quaternion(i));
    const double angle = std::remainder(turn.angle(), 2 * std::numbers::pi);
    vectors.row(i) = angle * turn.axis().transpose();
  }
  return vectors;
}

void add_features(const CsvMapping& mapping, const FeatureColumns& group, const DelimitedText& text,
                  const UsedRows& rows, MappedTrial& mapped) {
  Trial& trial = mapped.trial;
  const std::vector<std::size_t> columns = text.find(group.columns);
  Eigen::MatrixXd values = all_numbers(text, columns);
  if (group.unsmooth > 0) {
    const double w = group.unsmooth;
    for (Eigen::Index i = values.rows() - 1; i > 0; --i)
      values.row(i) = (values.row(i) - (1 - w) * values.row(i - 1)) / w;
  }
  values = (group.unit * values(rows.row, Eigen::all)).eval();
  if (!group.euler.empty()) {
    if (columns.size() != 3) {
      throw ConfigError("{}: Euler angles are three columns, not {} ('{}')", text.name(),
                        columns.size(), group.columns);
    }
    values = rotation_vectors(group.euler, values, mapping.rest_readings);
  }
  const Eigen::Index before = trial.features.cols();
  trial.features.conservativeResize(values.rows(), before + values.cols());
  trial.features.rightCols(values.cols()) = values;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string name = text.header().empty() ? fmt::format("column_{}", columns[i] + 1)
                                                   : text.header()[columns[i]];
    trial.feature_names.push_back(group.euler.empty() ? name
                                                      : fmt::format("{}_r{}", name, "xyz"[i]));
    const auto column = values.col(i);
    const double way = column.maxCoeff() - column.minCoeff();
    const bool turns = group.quantity == 'r';
    if (group.quantity == 0 || way <= (turns ? kMaxTurn : kMaxWay)) continue;
    mapped.notes.push_back(
        fmt::format("{}: column {} ({}) goes over {:.3g} {}, further than a platform on springs: "
                    "give its unit ({}), or leave out the row that is wrong",
                    text.name(), columns[i] + 1, trial.feature_names.back(), way,
                    turns ? "rad" : "m", turns ? "deg or mrad" : "mm or um"));
  }
}

void add_loads(const CsvMapping& mapping, const DelimitedText& text, const UsedRows& rows,
               Trial& trial) {
  trial.reference = Eigen::MatrixXd::Zero(rows.row.size(), 6);
  std::array<bool, 6> given{};
  std::size_t next = 0;
  for (const LoadColumns& group : mapping.loads) {
    const std::vector<std::size_t> columns = text.find(group.columns);
    const auto wrong = [&](std::size_t count, const char* what) {
      return ConfigError("{}: {} columns '{}', but {} {}", text.name(), columns.size(),
                         group.columns, count, what);
    };
    if (!group.counts_per_unit.empty() && group.counts_per_unit.size() != columns.size())
      throw wrong(group.counts_per_unit.size(), "counts");
    if (!group.axes.empty() && group.axes.size() != columns.size())
      throw wrong(group.axes.size(), "axes");
    Eigen::MatrixXd values = all_numbers(text, columns);
    if (mapping.zero_rows > 0) {
      const auto first = values.topRows(std::min<Eigen::Index>(mapping.zero_rows, values.rows()));
      values.rowwise() -= first.colwise().mean().eval();
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::size_t axis = group.axes.empty() ? next : group.axes[i];
      if (axis >= kWrenchAxes.size() || given[axis]) {
        throw ConfigError("{}: '{}' gives {}; name each axis once with axes=Fx,...", text.name(),
                          group.columns,
                          axis < kWrenchAxes.size() ? "an axis twice" : "more than six axes");
      }
      given[axis] = true;
      next = axis + 1;
      const double counts = group.counts_per_unit.empty() ? 1 : group.counts_per_unit[i];
      trial.reference.col(axis) = group.sign * group.unit / counts * values(rows.row, i);
    }
  }
}

ConfigError unknown(const std::string& option, const std::string& text, std::string_view part,
                    const std::string& known) {
  return ConfigError("{} {}: what is '{}'? Known: {}", option, text, part, known);
}

/// Of "KEY=VALUE" the value.
std::optional<std::string_view> value_of(std::string_view key, std::string_view part) {
  if (!part.starts_with(key)) return std::nullopt;
  return part.substr(key.size());
}

/// The columns that come first in `text`; calls `take` with each part behind them.
template <class Columns, class Take>
Columns parse_columns(const std::string& text, Take take) {
  const std::vector<std::string_view> parts = split(text, ':');
  Columns columns;
  columns.columns = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) take(parts[i], columns);
  return columns;
}

}  // namespace

FeatureColumns parse_feature_columns(const std::string& text, const std::string& option) {
  return parse_columns<FeatureColumns>(text, [&](std::string_view part, FeatureColumns& columns) {
    if (const Unit* unit = find_unit(kFeatureUnits, part)) {
      columns.unit = unit->si;
      columns.quantity = part.ends_with('m') ? 'm' : 'r';
    } else if (part == "euler") {
      columns.euler = "xyz";
    } else if (const auto order = value_of("euler=", part);
               order && order->size() == 3 &&
               order->find_first_not_of("xyz") == std::string_view::npos) {
      columns.euler = *order;
    } else if (const auto weight = value_of("unsmooth=", part)) {
      columns.unsmooth = parse_number(*weight).value_or(0);
      if (columns.unsmooth < kMinWeight || columns.unsmooth > 1)
        throw ConfigError("{} {}: the weight of a smoothing is from {:g} to 1", option, text,
                          kMinWeight);
    } else {
      throw unknown(option, text, part,
                    names(kFeatureUnits) + " euler euler=ORDER unsmooth=WEIGHT");
    }
  });
}

LoadColumns parse_load_columns(const std::string& text, const std::string& option) {
  return parse_columns<LoadColumns>(text, [&](std::string_view part, LoadColumns& columns) {
    if (const Unit* unit = find_unit(kLoadUnits, part)) {
      columns.unit = unit->si;
    } else if (part == "negative") {
      columns.sign = -1;
    } else if (const auto counts = value_of("counts=", part)) {
      for (const std::string_view one : split(*counts, ',')) {
        const double value = parse_number(one).value_or(0);
        if (std::abs(value) < 1 / DelimitedText::kMax || std::abs(value) > DelimitedText::kMax)
          throw ConfigError("{} {}: counts per unit are numbers from {:g} to {:g}", option, text,
                            1 / DelimitedText::kMax, DelimitedText::kMax);
        columns.counts_per_unit.push_back(value);
      }
    } else if (const auto axes = value_of("axes=", part)) {
      for (const std::string_view one : split(*axes, ',')) {
        const auto axis = std::find(kWrenchAxes.begin(), kWrenchAxes.end(), one);
        if (axis == kWrenchAxes.end())
          throw unknown(option, text, one, fmt::format("{}", fmt::join(kWrenchAxes, " ")));
        columns.axes.push_back(axis - kWrenchAxes.begin());
      }
    } else {
      throw unknown(option, text, part, names(kLoadUnits) + " counts=A,B,... axes=Fx,... negative");
    }
  });
}

double parse_time_unit(const std::string& text, const std::string& option) {
  const Unit* unit = find_unit(kTimeUnits, text);
  if (unit == nullptr)
    throw ConfigError("{}: no unit '{}'; use {}", option, text, names(kTimeUnits));
  return unit->si;
}

MappedTrial read_mapped(const CsvMapping& mapping) {
  MappedTrial mapped;
  Trial& trial = mapped.trial;
  trial.name = mapping.readings.stem().string();
  trial.file = mapping.readings.string();
  const DelimitedText readings(mapping.readings, mapping.separator, mapping.skip_lines);
  const UsedRows rows = rows_in_order(readings, mapping.reading_time, mapping.time_unit,
                                      mapping.skip_readings, mapped.notes);
  trial.time = rows.time;
  for (const FeatureColumns& group : mapping.features)
    add_features(mapping, group, readings, rows, mapped);

  if (mapping.reference.empty()) {
    trial.reference_time = rows.time;
    add_loads(mapping, readings, rows, trial);
  } else {
    const DelimitedText reference(mapping.reference, mapping.separator, mapping.skip_lines);
    const UsedRows felt =
        rows_in_order(reference, mapping.reference_time, mapping.reference_time_unit,
                      mapping.skip_references, mapped.notes);
    trial.reference_time = felt.time;
    add_loads(mapping, reference, felt, trial);
  }
  return mapped;
}

}  // namespace tagwrench::study
