// New values in a YAML text that people wrote: the keys that changed are replaced in it, everything
// else (comments, order, other sections) stays byte for byte.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

struct YamlEntry {
  std::string key;
  /// YAML flow notation: `805.0`, `[1, 2]`, `{a: 1}`. Further lines of a list or mapping are
  /// indented to fit.
  std::string value;
};

/// The keys of one top-level section that are to have new values.
struct SectionEdit {
  std::string section;
  std::vector<YamlEntry> entries;
};

/// `yaml` with the entries of `edit` in place of, or beside, those that its section has; a section
/// that is missing is added at the end. Works on block and flow notation. Throws ConfigError,
/// naming `name`, if the text is not a YAML mapping or the section is no mapping.
std::string with_keys(std::string_view yaml, const SectionEdit& edit, const std::string& name);

/// `yaml` with `value`, in flow notation, at a key below the keys of others; mappings that are
/// missing are added, and a value that is no mapping but should be one is replaced. Throws as
/// with_keys().
std::string with_value(std::string_view yaml, const std::vector<std::string>& path,
                       const std::string& value, const std::string& name);

/// Throws ConfigError where with_keys() could not edit this text, whatever the values: to be asked
/// before the measurement that the values come from.
void check_editable(std::string yaml, const std::vector<SectionEdit>& edits,
                    const std::string& name);

}  // namespace tagwrench
