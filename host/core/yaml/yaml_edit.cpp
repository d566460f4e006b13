#include "host/core/yaml/yaml_edit.h"

#include <fmt/format.h>
#include <yaml.h>

#include <algorithm>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"

namespace tagwrench {
namespace {

// Where the keys and values stand, to the byte.

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

constexpr int kDeepest = 64;  // levels of nesting; recursion must end

class Event {
 public:
  Event() = default;
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { yaml_event_delete(&event_); }
  yaml_event_t* get() { return &event_; }
  yaml_event_t* operator->() { return &event_; }

 private:
  yaml_event_t event_{};
};

/// libyaml counts characters, the text is bytes.
std::vector<std::size_t> byte_of_character(std::string_view text) {
  std::vector<std::size_t> bytes;
  bytes.reserve(text.size() + 1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if ((static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U) bytes.push_back(i);
  }
  bytes.push_back(text.size());
  return bytes;
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& name)
      : name_(name), text_(text), bytes_(byte_of_character(text)) {
    yaml_parser_initialize(&parser_);
    yaml_parser_set_encoding(&parser_, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()),
                                 text.size());
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { yaml_parser_delete(&parser_); }

  /// Of the only document.
  YamlNode root() {
    YamlNode out;
    for (bool ended = false;;) {
      Event event;
      next(event);
      if (event->type == YAML_STREAM_END_EVENT) return out;
      if (ended) fail(event->start_mark.line, "a second document begins here; keep one");
      ended = event->type == YAML_DOCUMENT_END_EVENT;
      if (!ended && event->type != YAML_STREAM_START_EVENT &&
          event->type != YAML_DOCUMENT_START_EVENT)
        out = node(event, 0);
    }
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw ConfigError(fmt::format("{}:{}: {}; check indentation, colons and brackets there", name_,
                                  line + 1, what));
  }
  void next(Event& event) {
    if (yaml_parser_parse(&parser_, event.get()) == 0) {
      fail(parser_.problem_mark.line,
           fmt::format("not YAML: {}",
                       parser_.problem != nullptr ? parser_.problem : "cannot be read"));
    }
  }
  std::size_t at(const yaml_mark_t& mark) const {
    return mark.index < bytes_.size() ? bytes_[mark.index] : text_.size();
  }

  YamlNode node(Event& event, int depth) {
    if (depth > kDeepest) fail(event->start_mark.line, "nested too deeply");
    YamlNode out;
    out.span = {at(event->start_mark), at(event->end_mark)};
    if (event->type == YAML_SCALAR_EVENT) {
      out.text.assign(reinterpret_cast<const char*>(event->data.scalar.value),
                      event->data.scalar.length);
      // A literal block's end lies behind its line.
      while (out.span.end > out.span.begin && text_[out.span.end - 1] == '\n') --out.span.end;
    } else if (event->type == YAML_MAPPING_START_EVENT) {
      out.kind = YamlNode::Kind::mapping;
      out.flow = event->data.mapping_start.style == YAML_FLOW_MAPPING_STYLE;
      children(out, YAML_MAPPING_END_EVENT, depth);
    } else if (event->type == YAML_SEQUENCE_START_EVENT) {
      out.kind = YamlNode::Kind::sequence;
      out.flow = event->data.sequence_start.style == YAML_FLOW_SEQUENCE_STYLE;
      children(out, YAML_SEQUENCE_END_EVENT, depth);
    }
    return out;
  }

  void children(YamlNode& parent, yaml_event_type_t end, int depth) {
    for (;;) {
      Event event;
      next(event);
      if (event->type == end) {
        // A block ends where the next one begins; its last child says where its text ends.
        if (parent.flow) {
          parent.span.end = at(event->end_mark);
        } else if (!parent.children.empty()) {
          parent.span.end = parent.children.back().span.end;
        }
        return;
      }
      parent.children.push_back(node(event, depth + 1));
    }
  }

  const std::string& name_;
  std::string_view text_;
  std::vector<std::size_t> bytes_;
  yaml_parser_t parser_{};
};

/// `text` takes the place of the bytes of `span`.
struct Replacement {
  Span span;
  std::string text;
};

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
Replacement addition(std::string_view yaml, const YamlNode& mapping, const std::string& key,
                     const std::string& value) {
  if (mapping.flow) {
    const bool empty = mapping.children.empty();
    const std::size_t at = empty ? mapping.span.begin + 1 : mapping.children.back().span.end;
    return {{at, at}, fmt::format("{}{}: {}", empty ? "" : ", ", key, value)};
  }
  const std::size_t at = line_end(yaml, mapping.span.end);
  const std::size_t indent = column(yaml, mapping.children.front().span.begin);
  const std::string line =
      std::string(indent, ' ') + key + ": " + indented(value, indent + key.size() + 2) + "\n";
  if (at == yaml.size()) return {{at, at}, std::string(1, '\n') + line};
  return {{at + 1, at + 1}, line};
}

}  // namespace

std::string with_value(std::string_view yaml, const std::vector<std::string>& path,
                       const std::string& value, const std::string& name) {
  if (yaml.starts_with("\xEF\xBB\xBF"))
    throw ConfigError(fmt::format("{}:1: begins with a byte order mark; save it without", name));
  const YamlNode root = Reader(yaml, name).root();
  if (root.kind != YamlNode::Kind::mapping)
    throw ConfigError(
        fmt::format("{}: expected 'key: value' lines at the top level, found none", name));
  const YamlNode* mapping = &root;
  for (std::size_t depth = 0; depth < path.size(); ++depth) {
    const std::size_t at = find_value(*mapping, path[depth]);
    const bool deeper = at > 0 && depth + 1 < path.size() &&
                        mapping->children[at].kind == YamlNode::Kind::mapping &&
                        !mapping->children[at].children.empty();
    if (deeper) {
      mapping = &mapping->children[at];
      continue;
    }
    std::string rest = value;
    for (std::size_t i = path.size() - 1; i > depth; --i)
      rest = fmt::format("{{{}: {}}}", path[i], rest);
    const Replacement r = at > 0 ? replacement(yaml, *mapping, at, rest)
                                 : addition(yaml, *mapping, path[depth], rest);
    return std::string(yaml).replace(r.span.begin, r.span.end - r.span.begin, r.text);
  }
  return std::string(yaml);
}

}  // namespace tagwrench
