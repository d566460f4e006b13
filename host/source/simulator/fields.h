// Settings by their keys in scenario.yaml: one table says how a number is read and what it may be.
#pragma once

#include <fmt/format.h>

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "host/core/yaml/yaml_section.h"

namespace tagwrench::sim {

constexpr double kMilli = 1e-3;
constexpr double kPercent = 1e-2;
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// A number or a list of them, with the limits of each in the unit of the key.
struct Field {
  Field(const char* name, double& value, double lowest, double highest, double its_unit = 1)
      : key(name), values(&value, 1), low(lowest), high(highest), unit(its_unit) {}
  template <typename Vector>
  Field(const char* name, Vector& list, double lowest, double highest, double its_unit = 1)
      : key(name),
        values(list.data(), static_cast<std::size_t>(list.size())),
        low(lowest),
        high(highest),
        unit(its_unit),
        is_list(true) {}

  const char* key;
  std::span<double> values;
  double low, high, unit;
  bool is_list = false;
};
using Fields = std::vector<Field>;

inline void read_fields(YamlSection& section, const Fields& fields) {
  for (Field field : fields) {
    if (field.is_list)
      section.numbers(field.key, field.values, field.unit);
    else
      section.number(field.key, field.values[0], field.unit);
  }
}

/// The first value beyond its limits, as a message; empty: none is.
inline std::string outside(const std::string& section, const Fields& fields) {
  for (const Field& field : fields) {
    for (const double value : field.values) {
      const double shown = value / field.unit;
      if (!(shown >= field.low && shown <= field.high))
        return fmt::format("{}: {} must lie between {:g} and {:g}, is {:g}", section, field.key,
                           field.low, field.high, shown);
    }
  }
  return {};
}

}  // namespace tagwrench::sim
