#include "host/core/yaml/yaml_edit.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/core/yaml/yaml_spans.h"

namespace tagwrench {
namespace {

/// `text` takes the place of the bytes of `span`.
struct Replacement {
  Span span;
  std::string text;
};

std::string apply(std::string_view yaml, std::vector<Replacement> replacements) {
  std::stable_sort(
      replacements.begin(), replacements.end(),
      [](const Replacement& a, const Replacement& b) { return a.span.begin > b.span.begin; });
  std::string out(yaml);
  for (const Replacement& r : replacements)
    out.replace(r.span.begin, r.span.end - r.span.begin, r.text);
  return out;
}

std::size_t line_start(std::string_view text, std::size_t at) {
  const std::size_t newline = at == 0 ? std::string_view::npos : text.rfind('\n', at - 1);
  return newline == std::string_view::npos ? 0 : newline + 1;
}

std::size_t line_end(std::string_view text, std::size_t at) {
  return std::min(text.find('\n', at), text.size());
}

std::size_t column(std::string_view text, std::size_t at) { return at - line_start(text, at); }

/// Lines after the first begin at `indent`.
std::string indented(const std::string& value, std::size_t indent) {
  std::string out;
  for (const char c : value) {
    out += c;
    if (c == '\n') out.append(indent, ' ');
  }
  return out;
}

std::string line_of(const YamlEntry& entry, std::size_t indent) {
  return std::string(indent, ' ') + entry.key + ": " +
         indented(entry.value, indent + entry.key.size() + 2) + "\n";
}

std::string flow_of(const std::vector<const YamlEntry*>& entries) {
  std::string out;
  for (const YamlEntry* entry : entries)
    out += fmt::format("{}{}: {}", out.empty() ? "" : ", ", entry->key, entry->value);
  return out;
}

/// Position of the value in `mapping.children`; 0 where there is no such key.
std::size_t find_value(const YamlNode& mapping, std::string_view key) {
  for (std::size_t i = 0; i + 1 < mapping.children.size(); i += 2) {
    if (mapping.children[i].kind == YamlNode::Kind::scalar && mapping.children[i].text == key)
      return i + 1;
  }
  return 0;
}

Replacement replacement(std::string_view yaml, const YamlNode& mapping, std::size_t value_at,
                        const std::string& value) {
  const Span key = mapping.children[value_at - 1].span;
  const YamlNode& old = mapping.children[value_at];
  if (!old.flow && line_start(yaml, old.span.begin) != line_start(yaml, key.begin)) {
    // A flow value must stand deeper than its key; a block list need not.
    const std::size_t indent = column(yaml, key.begin) + 2;
    return {{line_start(yaml, old.span.begin), old.span.end},
            std::string(indent, ' ') + indented(value, indent)};
  }
  const bool touches = old.span.begin > 0 && yaml[old.span.begin - 1] == ':';
  return {old.span, std::string(touches ? 1 : 0, ' ') +
                        indented(value, column(yaml, old.span.begin) + (touches ? 1 : 0))};
}

/// Puts entries that the mapping lacks after its last one.
Replacement addition(std::string_view yaml, const YamlNode& mapping,
                     const std::vector<const YamlEntry*>& entries) {
  if (mapping.flow) {
    const bool empty = mapping.children.empty();
    const std::size_t at = empty ? mapping.span.begin + 1 : mapping.children.back().span.end;
    return {{at, at}, fmt::format("{}{}", empty ? "" : ", ", flow_of(entries))};
  }
  const std::size_t at = line_end(yaml, mapping.span.end);
  const std::size_t indent = column(yaml, mapping.children.front().span.begin);
  std::string lines;
  for (const YamlEntry* entry : entries) lines += line_of(*entry, indent);
  if (at == yaml.size()) return {{at, at}, std::string(1, '\n') + lines};
  return {{at + 1, at + 1}, lines};
}

std::string with_new_section(std::string_view yaml, const YamlDocument& document,
                             const SectionEdit& edit) {
  std::vector<const YamlEntry*> entries;
  std::string lines = edit.section + ":\n";
  for (const YamlEntry& entry : edit.entries) {
    entries.push_back(&entry);
    lines += line_of(entry, 2);
  }
  if (document.root.flow) {
    const YamlEntry section{edit.section, fmt::format("{{{}}}", flow_of(entries))};
    return apply(yaml, {addition(yaml, document.root, {&section})});
  }
  const bool open_line = document.end > 0 && yaml[document.end - 1] != '\n';
  return apply(yaml,
               {{{document.end, document.end}, std::string(open_line ? 1 : 0, '\n') + lines}});
}

}  // namespace

std::string with_keys(std::string_view yaml, const SectionEdit& edit, const std::string& name) {
  const YamlDocument document = yaml_spans(yaml, name);
  if (document.root.kind != YamlNode::Kind::mapping)
    throw ConfigError(
        fmt::format("{}: expected 'key: value' lines at the top level, found none", name));
  const std::size_t section_at = find_value(document.root, edit.section);
  if (section_at == 0) return with_new_section(yaml, document, edit);
  const YamlNode& section = document.root.children[section_at];
  if (section.kind != YamlNode::Kind::mapping)
    throw ConfigError(
        fmt::format("{}: {}: must be a mapping of keys to values", name, edit.section));
  std::vector<Replacement> replacements;
  std::vector<const YamlEntry*> missing;
  for (const YamlEntry& entry : edit.entries) {
    if (const std::size_t at = find_value(section, entry.key); at > 0) {
      replacements.push_back(replacement(yaml, section, at, entry.value));
    } else {
      missing.push_back(&entry);
    }
  }
  // Before the others: where both touch one place, the addition is behind the replaced value.
  if (!missing.empty()) replacements.insert(replacements.begin(), addition(yaml, section, missing));
  return apply(yaml, std::move(replacements));
}

std::string with_value(std::string_view yaml, const std::vector<std::string>& path,
                       const std::string& value, const std::string& name) {
  const YamlDocument document = yaml_spans(yaml, name);
  if (document.root.kind != YamlNode::Kind::mapping)
    throw ConfigError(
        fmt::format("{}: expected 'key: value' lines at the top level, found none", name));
  const YamlNode* mapping = &document.root;
  for (std::size_t depth = 0; depth < path.size(); ++depth) {
    const std::size_t at = find_value(*mapping, path[depth]);
    const bool last = depth + 1 == path.size();
    const bool deeper = at > 0 && !last && mapping->children[at].kind == YamlNode::Kind::mapping &&
                        !mapping->children[at].children.empty();
    if (deeper) {
      mapping = &mapping->children[at];
      continue;
    }
    std::string rest = value;
    for (std::size_t i = path.size() - 1; i > depth; --i)
      rest = fmt::format("{{{}: {}}}", path[i], rest);
    if (at > 0) return apply(yaml, {replacement(yaml, *mapping, at, rest)});
    const YamlEntry entry{path[depth], rest};
    return apply(yaml, {addition(yaml, *mapping, {&entry})});
  }
  return std::string(yaml);
}

void check_editable(std::string yaml, const std::vector<SectionEdit>& edits,
                    const std::string& name) {
  for (const SectionEdit& edit : edits) yaml = with_keys(yaml, edit, name);
  try {
    YamlReader::from_text(yaml, name);
  } catch (const ConfigError& e) {
    throw ConfigError(fmt::format(
        "{}: cannot be edited: with new values in place it would no longer be YAML, perhaps for an "
        "anchor among the old ones; write them out in full (in the new text, {})",
        name, e.what()));
  }
}

}  // namespace tagwrench
