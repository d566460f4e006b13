#include "host/core/yaml/yaml_spans.h"

#include <fmt/format.h>
#include <yaml.h>

#include <utility>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

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

  YamlDocument document() {
    YamlDocument out;
    for (;;) {
      Event event;
      next(event);
      if (event->type == YAML_STREAM_END_EVENT) return out;
      if (event->type == YAML_DOCUMENT_END_EVENT) {
        const bool marked = event->data.document_end.implicit == 0;
        out.end = marked ? at(event->start_mark) : text_.size();
        Event after;
        next(after);
        if (after->type != YAML_STREAM_END_EVENT)
          fail(after->start_mark.line, "a second document begins here; keep one");
        return out;
      }
      if (event->type != YAML_STREAM_START_EVENT && event->type != YAML_DOCUMENT_START_EVENT)
        out.root = node(event, 0);
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

}  // namespace

YamlDocument yaml_spans(std::string_view text, const std::string& name) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF")
    throw ConfigError(fmt::format("{}:1: begins with a byte order mark; save it without", name));
  return Reader(text, name).document();
}

}  // namespace tagwrench
