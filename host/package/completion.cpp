#include "host/package/completion.h"

#include <algorithm>
#include <string_view>

#include "host/package/option_values.h"

namespace tagwrench {
namespace {

/// Where the typed words have led.
struct Place {
  const CLI::App* verb;
  const CLI::Option* open = nullptr;  ///< whose value comes next
};

const CLI::Option* find_option(const CLI::App& verb, const std::string& name) {
  for (const CLI::Option* option : visible_options(verb)) {
    if (option->check_name(name)) return option;
  }
  return nullptr;
}

const CLI::App* find_verb(const CLI::App& app, const std::string& name) {
  for (const CLI::App* verb : visible_verbs(app)) {
    if (verb->get_name() == name) return verb;
  }
  return nullptr;
}

void follow(const std::string& word, Place& place) {
  if (word == "=") return;  // bash takes --option=value for three words
  if (place.open != nullptr) {
    place.open = nullptr;
  } else if (word.starts_with("-")) {
    const CLI::Option* option = find_option(*place.verb, word);
    if (option != nullptr && takes_value(*option)) place.open = option;
  } else if (const CLI::App* verb = find_verb(*place.verb, word)) {
    place.verb = verb;
  }
}

void add(std::string word, const std::string& typed, Completion& out) {
  if (word.starts_with(typed)) out.words.push_back(std::move(word));
}

bool is_number(const CLI::Option& option) {
  const std::string name = value_name(option);
  return name == "INT" || name == "UINT" || name == "FLOAT" || name == "SECONDS";
}

void add_values(const CLI::Option& option, const std::string& typed,
                const std::vector<std::string>& profiles, Completion& out) {
  const bool profile = option.check_name("--profile") || option.check_name("profile");
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

void add_names(const CLI::App& verb, const std::string& typed, Completion& out) {
  for (const CLI::Option* option : visible_options(verb)) {
    for (const std::string& name : option->get_lnames()) add("--" + name, typed, out);
  }
}

}  // namespace

Completion complete(const CLI::App& app, const std::vector<std::string>& typed,
                    const std::vector<std::string>& profiles) {
  Completion out;
  if (typed.empty()) return out;
  Place place{&app};
  std::for_each(typed.begin(), typed.end() - 1,
                [&place](const std::string& word) { follow(word, place); });
  const std::string last = typed.back() == "=" ? "" : typed.back();
  if (place.open != nullptr) {
    add_values(*place.open, last, profiles, out);
  } else if (last.starts_with("-")) {
    add_names(*place.verb, last, out);
  } else if (const auto verbs = visible_verbs(*place.verb); !verbs.empty()) {
    for (const CLI::App* verb : verbs) add(verb->get_name(), last, out);
  } else {
    for (const CLI::Option* option : visible_options(*place.verb)) {
      if (option->get_positional()) add_values(*option, last, profiles, out);
    }
    if (last.empty()) add_names(*place.verb, last, out);
  }
  return out;
}

}  // namespace tagwrench
