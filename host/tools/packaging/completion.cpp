#include "host/tools/packaging/completion.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "host/tools/packaging/man_page.h"

namespace tagwrench {
namespace {

/// Where the typed words have led.
struct Place {
  command_line::Command verb;
  std::optional<command_line::Option> open = {};  ///< whose value comes next
};

std::optional<command_line::Option> find_option(const command_line::Command& verb,
                                                const std::string& name) {
  for (const command_line::Option& option : verb.options()) {
    if (option.has_name(name)) return option;
  }
  return {};
}

std::optional<command_line::Command> find_verb(const command_line::Command& above,
                                               const std::string& name) {
  for (const command_line::Command& verb : above.subcommands()) {
    if (verb.name() == name) return verb;
  }
  return {};
}

void follow(const std::string& word, Place& place) {
  if (word == "=") return;  // bash takes --option=value for three words
  if (place.open) {
    place.open.reset();
  } else if (word.starts_with("-")) {
    const auto option = find_option(place.verb, word);
    if (option && option->takes_value()) place.open = option;
  } else if (const auto verb = find_verb(place.verb, word)) {
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
  for (const command_line::Option& option : verb.options()) {
    for (const std::string& name : option.long_names()) add("--" + name, typed, out);
  }
}

}  // namespace

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
    for (const command_line::Option& option : place.verb.options()) {
      if (option.is_positional()) add_values(option, last, profiles, out);
    }
    if (last.empty()) add_names(place.verb, last, out);
  }
  return out;
}

}  // namespace tagwrench
