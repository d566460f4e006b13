#include "host/config/sensor_edit.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "host/config/sensor_config.h"
#include "host/config/yaml_reader.h"
#include "host/config/yaml_spans.h"
#include "host/config_error.h"
#include "host/os/unique_fd.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

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

/// What the path means after symbolic links; the path itself where there is nothing yet.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? path : real;
}

[[noreturn]] void cannot_write(const fs::path& path, const std::string& why) {
  throw std::runtime_error(fmt::format(
      "{}: cannot be written ({}); the old file is as it was: free some space, mend the "
      "permissions, or name another file with --out",
      path.string(), why));
}

/// A temporary file that goes away unless it has been renamed.
class Temporary {
 public:
  explicit Temporary(const fs::path& target)
      : target_(target),
        name_(target.string() + ".XXXXXX"),
        file_(::mkostemp(name_.data(), O_CLOEXEC)) {
    if (!file_) cannot_write(target_, std::strerror(errno));
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (!renamed_ && file_) ::unlink(name_.c_str());
  }

  void keep_mode_of_target() {
    struct stat old {};
    if (::stat(target_.c_str(), &old) == 0) {
      // Another's file stays another's where we may; the mode comes last, chown clears bits of it.
      [[maybe_unused]] const int ignored = ::fchown(file_.get(), old.st_uid, old.st_gid);
      if (::fchmod(file_.get(), old.st_mode & 07777) != 0)
        cannot_write(target_, std::strerror(errno));
      return;
    }
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(file_.get(), 0666 & ~mask);
  }
  void write(std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(file_.get(), text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) cannot_write(target_, std::strerror(errno));
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  void take_the_name() {
    if (::fsync(file_.get()) != 0 || ::rename(name_.c_str(), target_.c_str()) != 0)
      cannot_write(target_, std::strerror(errno));
    renamed_ = true;
  }

 private:
  fs::path target_;
  std::string name_;
  UniqueFd file_;
  bool renamed_ = false;
};

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

void check_replaceable(const fs::path& path) {
  const fs::path real = resolved(path);
  std::error_code error;
  const fs::file_status status = fs::status(real, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw ConfigError(fmt::format(
        "{}: is not a regular file; name the sensor.yaml to write with --out", path.string()));
  }
  if (fs::exists(status) && ::access(real.c_str(), W_OK) != 0) {
    throw ConfigError(
        fmt::format("{}: is write-protected ({}); chmod u+w it, or name another "
                    "file with --out",
                    path.string(), std::strerror(errno)));
  }
  const fs::path folder = real.has_parent_path() ? real.parent_path() : fs::path(".");
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throw ConfigError(
        fmt::format("{}: its folder cannot be written ({}); name another file with --out",
                    path.string(), std::strerror(errno)));
  }
}

void write_atomically(const fs::path& path, std::string_view text) {
  Temporary file(resolved(path));
  file.keep_mode_of_target();
  file.write(text);
  file.take_the_name();
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

void write_sensor(std::string yaml, const std::vector<SectionEdit>& edits, const fs::path& to) {
  for (const SectionEdit& edit : edits) yaml = with_keys(yaml, edit, to.string());
  // What is calibrated anew may make a calibration of the wrench void; that is no reason to refuse.
  parse_sensor(yaml, to.string(), WrenchCalibration::ignore);
  write_atomically(to, yaml);
}

std::string read_text(const fs::path& path) {
  std::error_code error;
  std::ifstream file;
  if (!fs::is_directory(path, error)) file.open(path, std::ios::binary);
  std::ostringstream text;
  if (!file.is_open() || !(text << file.rdbuf())) {
    throw ConfigError(
        fmt::format("{}: cannot be read; check the path and that it is a readable, non-empty file",
                    path.string()));
  }
  return text.str();
}

}  // namespace tagwrench
