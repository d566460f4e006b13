#include "host/core/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/text_file.h"

namespace tagwrench {
namespace {

/// In the units that files are written in; squares and products of such numbers stay finite.
constexpr double kMax = 1e12;
constexpr std::uint64_t kMaxBytes = 4U << 20;  // of a file, which a person writes

std::string joined(const std::vector<std::string_view>& names) {
  std::string out;
  for (std::string_view name : names) out += (out.empty() ? "" : ", ") + std::string(name);
  return out;
}

bool is_marker(std::string_view line, std::string_view marker) {
  return line.starts_with(marker) && (line.size() == 3 || line[3] == ' ' || line[3] == '\t');
}

/// The line, from 1, on which a second document begins; 0: none. By its markers, which at the
/// beginning of a line are part of no text (YAML 1.2, 9.1.2): yaml-cpp 0.7 passes it over, and its
/// LoadAll() finds documents without end in some texts.
int second_document(std::string_view text) {
  bool begun = false, ended = false;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    const std::size_t first = line.find_first_not_of(" \t");
    if (is_marker(line, "...")) {
      ended = begun;
    } else if (is_marker(line, "---") ||
               (first != std::string_view::npos && line[first] != '#' && line[0] != '%')) {
      if (ended || (begun && is_marker(line, "---"))) return number;
      begun = true;
    }
  }
  return 0;
}

}  // namespace

std::string yaml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    const auto byte = static_cast<unsigned char>(c);
    out += byte < 0x20 || byte == 0x7f ? '?' : c;
  }
  return out + '"';
}

YamlReader::YamlReader(YAML::Node node, std::string file, std::string path)
    : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {}

YamlReader YamlReader::from_file(const std::string& path) {
  return from_text(read_text(path, kMaxBytes), path);
}

YamlReader YamlReader::from_text(const std::string& text, const std::string& name) {
  if (const int line = second_document(text); line > 0) {
    throw ConfigError("{}:{}: a second document begins here, and only one is read; remove it", name,
                      line);
  }
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw ConfigError("{}:{}: not YAML: {}; check indentation, colons and brackets there", name,
                      e.mark.line + 1, e.msg);
  }
  if (!root.IsMap())
    throw ConfigError("{}: expected 'key: value' lines at the top level, found none", name);
  return YamlReader(root, name, "");
}

std::string YamlReader::full(const std::string& key) const { return path_ + key; }

void YamlReader::fail(const std::string& key, const std::string& message) const {
  const YAML::Node node = node_[key];
  const int line = (node ? node.Mark().line : node_.Mark().line) + 1;
  throw ConfigError("{}:{}: {}: {}", file_, line, full(key), message);
}

bool YamlReader::has(const std::string& key) {
  asked_.insert(key);
  return static_cast<bool>(std::as_const(node_)[key]);
}

YAML::Node YamlReader::required(const std::string& key) {
  asked_.insert(key);
  const YAML::Node node = std::as_const(node_)[key];
  if (!node) fail(key, fmt::format("is missing; add it (keys here: {})", keys_here()));
  return node;
}

std::string YamlReader::keys_here() const {
  std::string out;
  for (const auto& entry : node_)
    if (entry.first.IsScalar()) out += (out.empty() ? "" : ", ") + entry.first.Scalar();
  return out.empty() ? "none" : out;
}

YamlReader YamlReader::child(const std::string& key) {
  const YAML::Node node = required(key);
  if (!node.IsMap()) fail(key, "must be a mapping of keys to values");
  return YamlReader(node, file_, full(key) + ".");
}

std::vector<YamlReader> YamlReader::children(const std::string& key) {
  const YAML::Node node = required(key);
  if (!node.IsSequence() || node.size() == 0) fail(key, "must be a list with at least one entry");
  std::vector<YamlReader> out;
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (!node[i].IsMap())
      fail(key, fmt::format("entry {} must be a mapping such as {{id: 5}}", i + 1));
    out.push_back(YamlReader(node[i], file_, fmt::format("{}[{}].", full(key), i)));
  }
  return out;
}

double YamlReader::finite(const std::string& key, const YAML::Node& node) const {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value))
    fail(key, "must be a number");
  if (!std::isfinite(value)) fail(key, "must be a finite number, not NaN or infinity");
  if (std::abs(value) > kMax)
    fail(key, fmt::format("{} is beyond all measure; use at most {}", value, kMax));
  return value;
}

double YamlReader::number(const std::string& key) { return finite(key, required(key)); }

double YamlReader::positive(const std::string& key) {
  const double value = number(key);
  if (value <= 0) fail(key, fmt::format("must be greater than 0, is {}", value));
  return value;
}

double YamlReader::non_negative(const std::string& key) {
  const double value = number(key);
  if (value < 0) fail(key, fmt::format("must not be negative, is {}", value));
  return value;
}

double YamlReader::within(const std::string& key, double lowest, double highest) {
  const double value = number(key);
  if (value < lowest || value > highest)
    fail(key, fmt::format("must be {} to {}, is {}", lowest, highest, value));
  return value;
}

int YamlReader::integer(const std::string& key, int lowest, int highest) {
  const YAML::Node node = required(key);
  int value = 0;
  if (!node.IsScalar() || !YAML::convert<int>::decode(node, value))
    fail(key, "must be a whole number");
  if (value < lowest || value > highest)
    fail(key, fmt::format("must be {} to {}, is {}", lowest, highest, value));
  return value;
}

bool YamlReader::boolean(const std::string& key) {
  const YAML::Node node = required(key);
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value))
    fail(key, "must be true or false");
  return value;
}

std::string YamlReader::text(const std::string& key) {
  const YAML::Node node = required(key);
  if (!node.IsScalar()) fail(key, "must be a single text value");
  return node.Scalar();
}

std::vector<std::string> YamlReader::texts(const std::string& key) {
  const YAML::Node node = required(key);
  if (!node.IsSequence()) fail(key, "must be a list of text values, such as [one, two]");
  std::vector<std::string> out;
  for (const YAML::Node& item : node) {
    if (!item.IsScalar())
      fail(key, fmt::format("entry {} must be a single text value", out.size() + 1));
    out.push_back(item.Scalar());
  }
  return out;
}

std::vector<double> YamlReader::numbers(const std::string& key, std::size_t count) {
  const YAML::Node node = required(key);
  if (!node.IsSequence() || node.size() != count) {
    fail(key, fmt::format("must be a list of {} numbers{}", count,
                          node.IsSequence() ? fmt::format(", has {}", node.size()) : ""));
  }
  std::vector<double> out;
  for (const YAML::Node& item : node) out.push_back(finite(key, item));
  return out;
}

std::vector<std::vector<double>> YamlReader::points(const std::string& key, std::size_t dimension) {
  const YAML::Node node = required(key);
  if (!node.IsSequence() || node.size() == 0)
    fail(key, fmt::format("must be a list of [{} numbers]", dimension));
  std::vector<std::vector<double>> out;
  for (const YAML::Node& row : node) {
    if (!row.IsSequence() || row.size() != dimension)
      fail(key, fmt::format("entry {} must have {} numbers", out.size() + 1, dimension));
    out.emplace_back();
    for (const YAML::Node& item : row) out.back().push_back(finite(key, item));
  }
  return out;
}

std::size_t YamlReader::one_of(const std::string& key, const std::vector<std::string_view>& names) {
  const std::string value = text(key);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == value) return i;
  fail(key, fmt::format("'{}' is not known; use one of: {}", value, joined(names)));
}

double YamlReader::number_or(const std::string& key, double fallback) {
  return has(key) ? number(key) : fallback;
}
double YamlReader::non_negative_or(const std::string& key, double fallback) {
  return has(key) ? non_negative(key) : fallback;
}
int YamlReader::integer_or(const std::string& key, int lowest, int highest, int fallback) {
  return has(key) ? integer(key, lowest, highest) : fallback;
}
bool YamlReader::boolean_or(const std::string& key, bool fallback) {
  return has(key) ? boolean(key) : fallback;
}
std::string YamlReader::text_or(const std::string& key, const std::string& fallback) {
  return has(key) ? text(key) : fallback;
}
std::vector<double> YamlReader::numbers_or(const std::string& key, std::vector<double> fallback) {
  return has(key) ? numbers(key, fallback.size()) : fallback;
}

void YamlReader::finish() {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar())
      throw ConfigError("{}:{}: a key must be plain text", file_, entry.first.Mark().line + 1);
    const std::string key = entry.first.Scalar();
    if (!seen.insert(key).second) {
      throw ConfigError("{}:{}: {}: stands here twice; remove one", file_,
                        entry.first.Mark().line + 1, full(key));
    }
    if (asked_.count(key) == 0) {
      std::vector<std::string_view> known(asked_.begin(), asked_.end());
      throw ConfigError("{}:{}: {}: unknown key; known keys here: {}", file_,
                        entry.first.Mark().line + 1, full(key), joined(known));
    }
  }
}

}  // namespace tagwrench
