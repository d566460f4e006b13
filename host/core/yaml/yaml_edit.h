// New values in a YAML text that people wrote: the values that changed are replaced in it,
// everything else (comments, order, other sections) stays byte for byte.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

// Where the keys and values of a YAML text stand, to the byte, so that it can be edited as text.

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

/// `yaml` with `value`, in flow notation, at a key below the keys of others; mappings that are
/// missing are added, and a value that is no mapping but should be one is replaced. Works on block
/// and flow notation. Throws ConfigError, naming `name`, if the text is not a YAML mapping.
std::string with_value(std::string_view yaml, const std::vector<std::string>& path,
                       const std::string& value, const std::string& name);

}  // namespace tagwrench
