// What the help text says that may follow an option, for man pages and completion.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tagwrench {

/// Verbs and options that are only for programs have no group.
inline bool is_hidden(const CLI::App& verb) { return verb.get_group().empty(); }
inline bool is_hidden(const CLI::Option& option) { return option.get_group().empty(); }

/// The verbs of `app` that people may use, in order.
std::vector<const CLI::App*> visible_verbs(const CLI::App& app);

/// The options of `verb` that people may use, in order; arguments without a name are among them.
std::vector<const CLI::Option*> visible_options(const CLI::App& verb);

/// Whether a word follows it.
bool takes_value(const CLI::Option& option);

/// "FILE", "INT", "{cad,game}": what the word is, in the words of the help text.
std::string value_name(const CLI::Option& option);

/// The words that may follow: the members of a set, or the first words of the indented lines of its
/// description. One that ends in a colon goes on, with a file say. Empty: there is no list.
std::vector<std::string> value_choices(const CLI::Option& option);

}  // namespace tagwrench
