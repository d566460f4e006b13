#include "host/tools/packaging/man_page.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

namespace tagwrench {
namespace {

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

/// "sim:SCENARIO.yaml" -> "sim:", "spnav[:PATH]" -> "spnav", "v4l2:/dev/videoN[...]" -> "v4l2:".
std::string fixed_part(std::string_view word) {
  const std::size_t end = word.find_first_of("[:");
  if (end == std::string_view::npos) return std::string(word);
  return std::string(word.substr(0, word[end] == ':' ? end + 1 : end));
}

void add_once(std::vector<std::string>& words, std::string word) {
  if (!word.empty() && std::find(words.begin(), words.end(), word) == words.end())
    words.push_back(std::move(word));
}

/// "  jsonl:FILE, csv:FILE          one line per frame" -> jsonl:, csv:
void add_from_line(std::string_view line, std::vector<std::string>& words) {
  line.remove_prefix(line.find_first_not_of(' '));
  const std::string_view head = line.substr(0, line.find("  "));
  std::istringstream parts{std::string(head)};
  for (std::string part; parts >> part;) {
    if (part == "|") continue;
    if (part.back() == ',') part.pop_back();
    add_once(words, fixed_part(part));
  }
}

}  // namespace

std::string value_name(const command_line::Option& option) {
  const std::string type = option.value_type();
  const std::size_t set = type.find('{');
  if (set != std::string::npos) return type.substr(set, type.find('}') + 1 - set);
  return type.substr(0, type.find(':'));
}

std::vector<std::string> value_choices(const command_line::Option& option) {
  std::vector<std::string> words;
  const std::string name = value_name(option);
  if (!name.empty() && name.front() == '{') return split(name.substr(1, name.size() - 2), ',');
  for (const std::string& line : split(option.description(), '\n')) {
    if (line.starts_with("  ")) add_from_line(line, words);
  }
  return words;
}

namespace {

constexpr const char* kProgram = "tagwrench";

constexpr std::string_view kExitStatus =
    ".SH EXIT STATUS\n"
    "0: done. 1: failed while running. 2: wrong usage, or a configuration that cannot be used. "
    "Each\n"
    "failure is one line on standard error that says what, where, and what to do.\n";

constexpr std::string_view kFiles =
    ".SH FILES\n"
    ".TP\n.I ~/.config/tagwrench/sensor.yaml\nThe sensor of this desk.\n"
    ".TP\n.I ~/.config/tagwrench/run.env\n"
    "Options of the service: OPTIONS=... and OUTPUTS=... as in\n"
    "/usr/share/doc/tagwrench/examples/run.env.\n"
    ".TP\n.I $XDG_RUNTIME_DIR/tagwrench\nSockets of sensors that run.\n"
    ".SH SERVICE\n"
    "systemctl \\-\\-user enable \\-\\-now tagwrench starts it at each login;\n"
    "journalctl \\-\\-user \\-u tagwrench shows what it says.\n";

/// As text of a line that is not a request.
std::string escaped(std::string_view text) {
  std::string out;
  if (!text.empty() && (text.front() == '.' || text.front() == '\'')) out = "\\&";
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

/// Lines that begin with blanks are tables and stay as they are; the others make a paragraph.
std::string paragraph(std::string_view text) {
  std::string out;
  bool table = false;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const bool row = line.starts_with("  ");
    if (row != table) out += row ? ".nf\n" : ".fi\n";
    table = row;
    if (!line.empty()) out += (row ? "\\&" : "") + escaped(line) + "\n";
  }
  if (table) out += ".fi\n";
  return out;
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// "-o, --out FILE", in bold and italics.
std::string heading(const command_line::Option& option) {
  std::string out;
  const auto add = [&out](const std::string& name) {
    out += (out.empty() ? "" : ", ") + ("\\fB" + escaped(name) + "\\fR");
  };
  for (const std::string& name : option.short_names()) add("-" + name);
  for (const std::string& name : option.long_names()) add("--" + name);
  if (out.empty()) return "\\fI" + escaped(option.name()) + "\\fR";
  if (option.takes_value()) out += " \\fI" + escaped(value_name(option)) + "\\fR";
  return out;
}

std::string options_section(const command_line::Command& verb) {
  std::string out;
  for (const command_line::Option& option : verb.options()) {
    out += ".TP\n" + heading(option) + "\n" + paragraph(option.description());
    if (!option.default_text().empty())
      out += "(by default " + escaped(option.default_text()) + ")\n";
    if (option.is_required()) out += "(required)\n";
  }
  return out.empty() ? out : ".SH OPTIONS\n" + out;
}

std::string replaced(std::string text, char from, char to) {
  std::replace(text.begin(), text.end(), from, to);
  return text;
}

/// "tagwrench board flash" -> "tagwrench-board-flash".
std::string page_name(const std::string& words) { return replaced(words, ' ', '-'); }

std::string verbs_section(const command_line::Command& program, const std::string& words) {
  std::string out;
  for (const command_line::Command& verb : program.subcommands()) {
    out += ".TP\n.BR " + escaped(page_name(words + " " + verb.name())) + " (1)\n" +
           paragraph(verb.description());
  }
  return out.empty() ? out : ".SH VERBS\n" + out;
}

std::string synopsis(const command_line::Command& verb, const std::string& words) {
  std::string out = ".SH SYNOPSIS\n.B " + escaped(words) + "\n";
  if (!verb.subcommands().empty()) out += "\\fIVERB\\fR\n";
  out += "[\\fIOPTION\\fR]...\n";
  for (const command_line::Option& option : verb.options()) {
    if (!option.is_positional()) continue;
    const std::string name = "\\fI" + escaped(option.name()) + "\\fR";
    out += (option.is_required() ? name : "[" + name + "]") + "\n";
  }
  return out;
}

/// `words`: "tagwrench board flash".
std::string page(const command_line::Command& verb, const std::string& words,
                 const std::string& version) {
  const std::string name = page_name(words);
  std::string title = name;
  for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::string summary = verb.description();
  const bool first = words == kProgram;
  const std::string own_name = words + ": ";
  if (summary.starts_with(own_name)) summary.erase(0, own_name.size());
  return ".TH " + escaped(title) + " 1 \"\" \"tagwrench " + version + "\" \"User Commands\"\n" +
         ".SH NAME\n" + escaped(name) + " \\- " + escaped(replaced(summary, '\n', ' ')) + "\n" +
         synopsis(verb, words) + ".SH DESCRIPTION\n" + paragraph(capital(summary) + ".") +
         paragraph(verb.footer_text()) + verbs_section(verb, words) + options_section(verb) +
         std::string(first ? kFiles : "") + std::string(kExitStatus) +
         (first ? "" : ".SH SEE ALSO\n.BR tagwrench (1)\n");
}

void add_pages(const command_line::Command& verb, const std::string& words,
               const std::string& version, std::vector<ManPage>& pages) {
  pages.push_back({page_name(words), page(verb, words, version)});
  for (const command_line::Command& below : verb.subcommands())
    add_pages(below, words + " " + below.name(), version, pages);
}

}  // namespace

std::vector<ManPage> man_pages(const command_line::Command& program, const std::string& version) {
  std::vector<ManPage> pages;
  add_pages(program, kProgram, version, pages);
  return pages;
}

}  // namespace tagwrench
