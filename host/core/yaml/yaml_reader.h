// A YAML mapping read with every check: unknown key, wrong type, missing key, number out of range,
// NaN, wrong count. Each complaint is one line that names file, line and key.
//
//   YamlReader root = YamlReader::from_file("sensor.yaml");
//   YamlReader camera = root.child("camera");
//   model.width_px = camera.positive_int("width");
//   camera.finish();   // any key not asked for is an error
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagwrench {

/// In double quotes, as a YAML value: names may hold anything but control characters.
std::string yaml_quoted(std::string_view text);

class YamlReader {
 public:
  /// Throws ConfigError if the file cannot be read, is not YAML, or its root is not a mapping.
  static YamlReader from_file(const std::string& path);
  static YamlReader from_text(const std::string& text, const std::string& name);

  bool has(const std::string& key);
  /// A mapping below this one; must exist.
  YamlReader child(const std::string& key);
  /// A list of mappings; must exist and not be empty.
  std::vector<YamlReader> children(const std::string& key);

  double number(const std::string& key);
  double positive(const std::string& key);
  double non_negative(const std::string& key);
  /// Both ends included.
  double within(const std::string& key, double lowest, double highest);
  int integer(const std::string& key, int lowest, int highest);
  bool boolean(const std::string& key);
  std::string text(const std::string& key);
  /// A list of text values, which may be empty.
  std::vector<std::string> texts(const std::string& key);
  /// Exactly `count` finite numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count);
  /// A non-empty list of points, each of exactly `dimension` finite numbers.
  std::vector<std::vector<double>> points(const std::string& key, std::size_t dimension);
  /// The position in `names` of the text at `key`.
  std::size_t one_of(const std::string& key, const std::vector<std::string_view>& names);

  // With a default where the key is absent.
  double number_or(const std::string& key, double fallback);
  double non_negative_or(const std::string& key, double fallback);
  int integer_or(const std::string& key, int lowest, int highest, int fallback);
  bool boolean_or(const std::string& key, bool fallback);
  std::string text_or(const std::string& key, const std::string& fallback);
  std::vector<double> numbers_or(const std::string& key, std::vector<double> fallback);

  /// Throws ConfigError for the first key that nobody asked for, and names those that exist.
  void finish();

  /// Throws ConfigError "file:line: key: message".
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;

  const std::string& file() const { return file_; }

 private:
  YamlReader(YAML::Node node, std::string file, std::string path);
  YAML::Node required(const std::string& key);
  double finite(const std::string& key, const YAML::Node& node) const;
  std::string full(const std::string& key) const;
  std::string keys_here() const;

  YAML::Node node_;
  std::string file_;
  std::string path_;  ///< of keys from the root, "camera."
  std::set<std::string> asked_;
};

/// A mapping whose keys go over the defaults that a struct already holds, converted to SI.
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
