// Where the keys and values of a YAML text stand, to the byte, so that it can be edited as text.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

/// Bytes [begin, end) of the text.
struct Span {
  std::size_t begin = 0;
  std::size_t end = 0;
};

struct YamlNode {
  enum class Kind : unsigned char { scalar, sequence, mapping };
  Kind kind = Kind::scalar;
  bool flow = true;  ///< of collections: [..] or {..}
  Span span;         ///< ends with the last character that is not a blank, a comment or a line end
  std::string text;  ///< of scalars
  std::vector<YamlNode> children;  ///< of mappings: key, value, key, value ...
};

struct YamlDocument {
  YamlNode root;
  std::size_t end = 0;  ///< where more text of the first document may be added
};

/// Throws ConfigError, naming `name` and the line, if the text is not UTF-8 YAML.
YamlDocument yaml_spans(std::string_view text, const std::string& name);

}  // namespace tagwrench
