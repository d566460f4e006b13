// New values in a YAML text that people wrote: the values that changed are replaced in it,
// everything else (comments, order, other sections) stays byte for byte.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

/// `yaml` with `value`, in flow notation, at a key below the keys of others; mappings that are
/// missing are added, and a value that is no mapping but should be one is replaced. Works on block
/// and flow notation. Throws ConfigError, naming `name`, if the text is not a UTF-8 YAML mapping.
std::string with_value(std::string_view yaml, const std::vector<std::string>& path,
                       const std::string& value, const std::string& name);

}  // namespace tagwrench
