#include "host/core/yaml/yaml_edit.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_spans.h"

namespace tagwrench {
namespace {

struct YamlEntry {
  std::string key;
  std::string value;  ///< in flow notation
};

/// `text` takes the place of the bytes of `span`.
struct Replacement {
  Span span;
  std::string text;
};

std::string with_replacement(std::string_view yaml, const Replacement& r) {
  return std::string(yaml).replace(r.span.begin, r.span.end - r.span.begin, r.text);
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

/// Puts an entry that the mapping lacks after its last one.
Replacement addition(std::string_view yaml, const YamlNode& mapping, const YamlEntry& entry) {
  if (mapping.flow) {
    const bool empty = mapping.children.empty();
    const std::size_t at = empty ? mapping.span.begin + 1 : mapping.children.back().span.end;
    return {{at, at}, fmt::format("{}{}: {}", empty ? "" : ", ", entry.key, entry.value)};
  }
  const std::size_t at = line_end(yaml, mapping.span.end);
  const std::size_t indent = column(yaml, mapping.children.front().span.begin);
  const std::string line = line_of(entry, indent);
  if (at == yaml.size()) return {{at, at}, std::string(1, '\n') + line};
  return {{at + 1, at + 1}, line};
}

}  // namespace

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
    return with_replacement(yaml, at > 0 ? replacement(yaml, *mapping, at, rest)
                                         : addition(yaml, *mapping, {path[depth], rest}));
  }
  return std::string(yaml);
}

}  // namespace tagwrench
