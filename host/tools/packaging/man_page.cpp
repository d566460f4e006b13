#include "host/tools/packaging/man_page.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <sstream>
#include <string_view>

#include "host/core/parse.h"

namespace tagwrench {
namespace {

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

/// "FILE", "INT", "{cad,game}": what the word behind an option is, in the words of the help text.
std::string value_name(const command_line::Option& option) {
  const std::string type = option.value_type();
  const std::size_t set = type.find('{');
  if (set != std::string::npos) return type.substr(set, type.find('}') + 1 - set);
  return type.substr(0, type.find(':'));
}

/// The words that may follow: the members of a set, or the first words of the indented lines of its
/// description. One that ends in a colon goes on, with a file say. Empty: there is no list.
std::vector<std::string> value_choices(const command_line::Option& option) {
  std::vector<std::string> words;
  const std::string name = value_name(option);
  if (name.starts_with('{')) {
    for (const std::string_view word :
         split(std::string_view(name).substr(1, name.size() - 2), ','))
      words.emplace_back(word);
    return words;
  }
  const std::string description = option.description();
  for (const std::string_view line : split(description, '\n'))
    if (line.starts_with("  ")) add_from_line(line, words);
  return words;
}

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
  for (const char c : text)
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  return out;
}

/// Lines that begin with blanks are tables and stay as they are; the others make a paragraph.
std::string paragraph(std::string_view text) {
  std::string out;
  bool table = false;
  for (const std::string_view line : split(text, '\n')) {
    const bool row = line.starts_with("  ");
    if (row != table) out += row ? ".nf\n" : ".fi\n";
    table = row;
    if (!line.empty()) out += (row ? "\\&" : "") + escaped(line) + "\n";
  }
  if (table) out += ".fi\n";
  return out;
}

char upper(char c) { return static_cast<char>(std::toupper(static_cast<unsigned char>(c))); }

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
  for (char& c : title) c = upper(c);
  std::string summary = verb.description();
  const bool first = words == kProgram;
  const std::string own_name = words + ": ";
  if (summary.starts_with(own_name)) summary.erase(0, own_name.size());
  const std::string name_line = escaped(name) + " \\- " + escaped(replaced(summary, '\n', ' '));
  if (!summary.empty()) summary[0] = upper(summary[0]);
  return ".TH " + escaped(title) + " 1 \"\" \"tagwrench " + version + "\" \"User Commands\"\n" +
         ".SH NAME\n" + name_line + "\n" + synopsis(verb, words) + ".SH DESCRIPTION\n" +
         paragraph(summary + ".") + paragraph(verb.footer_text()) + verbs_section(verb, words) +
         options_section(verb) + std::string(first ? kFiles : "") + std::string(kExitStatus) +
         (first ? "" : ".SH SEE ALSO\n.BR tagwrench (1)\n");
}

void add_pages(const command_line::Command& verb, const std::string& words,
               const std::string& version, std::vector<ManPage>& pages) {
  pages.push_back({page_name(words), page(verb, words, version)});
  for (const command_line::Command& below : verb.subcommands())
    add_pages(below, words + " " + below.name(), version, pages);
}

/// Where the typed words have led.
struct Place {
  command_line::Command verb;
  std::optional<command_line::Option> open = {};  ///< whose value comes next
};

template <class Item, class Is>
std::optional<Item> first_that(const std::vector<Item>& items, Is is) {
  const auto found = std::ranges::find_if(items, is);
  return found == items.end() ? std::nullopt : std::optional(*found);
}

void follow(const std::string& word, Place& place) {
  if (word == "=") return;  // bash takes --option=value for three words
  if (place.open) {
    place.open.reset();
  } else if (word.starts_with("-")) {
    const auto option =
        first_that(place.verb.options(), [&](const auto& o) { return o.has_name(word); });
    if (option && option->takes_value()) place.open = option;
  } else if (const auto verb = first_that(place.verb.subcommands(),
                                          [&](const auto& v) { return v.name() == word; })) {
    place.verb = *verb;
  }
}

void add(std::string word, const std::string& typed, Completion& out) {
  if (word.starts_with(typed)) out.words.push_back(std::move(word));
}

bool is_number(const command_line::Option& option) {
  const std::string name = value_name(option);
  return name == "INT" || name == "UINT" || name == "FLOAT" || name == "SECONDS";
}

void add_values(const command_line::Option& option, const std::string& typed,
                const std::vector<std::string>& profiles, Completion& out) {
  const bool profile = option.has_name("--profile") || option.has_name("profile");
  const std::vector<std::string> choices = profile ? profiles : value_choices(option);
  for (const std::string& choice : choices) {
    if (choice.ends_with(":") && typed.starts_with(choice)) {
      out = {{}, true, choice};
      return;
    }
    add(choice, typed, out);
  }
  out.files = profile || (choices.empty() && !is_number(option));
}

void add_names(const command_line::Command& verb, const std::string& typed, Completion& out) {
  for (const command_line::Option& option : verb.options())
    for (const std::string& name : option.long_names()) add("--" + name, typed, out);
}

}  // namespace

std::vector<ManPage> man_pages(const command_line::Command& program, const std::string& version) {
  std::vector<ManPage> pages;
  add_pages(program, kProgram, version, pages);
  return pages;
}

Completion complete(const command_line::Command& program, const std::vector<std::string>& typed,
                    const std::vector<std::string>& profiles) {
  Completion out;
  if (typed.empty()) return out;
  Place place{program};
  std::for_each(typed.begin(), typed.end() - 1,
                [&place](const std::string& word) { follow(word, place); });
  const std::string last = typed.back() == "=" ? "" : typed.back();
  if (place.open) {
    add_values(*place.open, last, profiles, out);
  } else if (last.starts_with("-")) {
    add_names(place.verb, last, out);
  } else if (const auto verbs = place.verb.subcommands(); !verbs.empty()) {
    for (const command_line::Command& verb : verbs) add(verb.name(), last, out);
  } else {
    for (const command_line::Option& option : place.verb.options())
      if (option.is_positional()) add_values(option, last, profiles, out);
    if (last.empty()) add_names(place.verb, last, out);
  }
  return out;
}

}  // namespace tagwrench
