// A mapping whose keys go over the defaults that a struct already holds, converted to SI.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "host/core/yaml/yaml_reader.h"

namespace tagwrench {

class YamlSection {
 public:
  explicit YamlSection(YamlReader reader) : reader_(std::move(reader)) {}

  void number(const char* key, double& value, double unit = 1.0) {
    if (reader_.has(key)) value = unit * reader_.number(key);
  }
  template <typename Vector>  // anything with size() and []
  void numbers(const char* key, Vector& value, double unit = 1.0) {
    if (!reader_.has(key)) return;
    const std::vector<double> read = reader_.numbers(key, static_cast<std::size_t>(value.size()));
    for (std::size_t i = 0; i < read.size(); ++i) value[static_cast<int>(i)] = unit * read[i];
  }
  template <typename Enum>
  void choice(const char* key, Enum& value, const std::vector<std::string_view>& names) {
    if (reader_.has(key)) value = static_cast<Enum>(reader_.one_of(key, names));
  }
  YamlReader& reader() { return reader_; }
  void finish() { reader_.finish(); }

 private:
  YamlReader reader_;
};

}  // namespace tagwrench
