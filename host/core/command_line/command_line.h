// Commands, options and what is wrong with their use: CLI11, seen by one source file alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tagwrench::command_line {

/// Says why a word is no value of its option; empty: it is one.
struct Check {
  std::function<std::string(std::string&)> refusal;
  std::string name;  ///< behind the type in the help text
};

/// A whole number, or a number, from `least` to `most`. The latter lets NaN pass.
Check range(int least, int most);
Check range(double least, double most);
/// Above 0; lets NaN pass.
Check positive_number();
/// Never NaN. Otherwise "'TEXT' is not " and `what`, for example "a mass in kg from 0 to 5".
Check number(double least, double most, const std::string& what, const std::string& name);
/// How long something runs: 0.001 to 1e9 s.
Check seconds();
Check one_of(std::initializer_list<const char*> words);
Check one_of(std::initializer_list<int> numbers);

/// As options read them; nothing if `text` is not a number, or more than one.
std::optional<double> to_number(const std::string& text);

/// A handle, as cheap as a pointer, of an option, a flag or an argument without a name.
class Option {
 public:
  Option() = default;
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required();
  Option check(const Check& check);
  /// The help text has what the variable holds now.
  Option capture_default_str();
  Option needs(Option other);
  /// Either way round.
  Option excludes(Option other);
  /// Between the values in one word.
  Option delimiter(char character);
  /// Number of values.
  Option expected(int count);
  Option expected(int least, int most);
  /// Only for programs: not in help, manual and completion.
  Option hidden();

  /// Of values, or of times that a flag was given; known after parsing.
  std::size_t count() const;

  /// "--out"; of an argument without dashes the word itself.
  std::string name() const;
  bool has_name(const std::string& name) const;
  std::vector<std::string> long_names() const;   ///< without their dashes
  std::vector<std::string> short_names() const;  ///< without their dash
  std::string description() const;
  /// "INT", "TEXT:{cad,game}": what comes behind the name in the help text.
  std::string value_type() const;
  std::string default_text() const;
  bool takes_value() const;
  bool is_required() const;
  bool is_positional() const;

 private:
  CLI::Option* option_ = nullptr;
};

/// A handle, as cheap as a pointer, of the program, a command or one below it.
class Command {
 public:
  Command() = default;
  Command(CLI::App* app, std::function<int()>* action) : app_(app), action_(action) {}

  Command add_subcommand(const std::string& name, const std::string& description);
  /// `value` is written by parsing: it must stay where it is until then.
  /// Values: text, paths, whole numbers and numbers, some of them optional or in lists: what
  /// command_line.cpp instantiates.
  template <typename Value>
  Option add_option(const std::string& name, Value& value, const std::string& description = "");
  Option add_flag(const std::string& name, bool& value, const std::string& description);

  /// Below the options in the help text.
  Command footer(const std::string& text);
  /// One of the commands below it must be given.
  Command require_subcommand();
  /// Only for programs: not in help, manual and completion.
  Command hidden();
  /// What it does if it was given, and what is to be checked before, while all of it has just been
  /// read: that may call missing().
  void runs(std::function<int()> action, std::function<void()> check = {});

  /// Of the option of this name.
  std::size_t count(const std::string& name) const;

  std::string name() const;
  std::string description() const;
  std::string footer_text() const;
  /// Those that are not hidden, in order.
  std::vector<Command> subcommands() const;
  std::vector<Option> options() const;

 private:
  CLI::App* app_ = nullptr;
  std::function<int()>* action_ = nullptr;  ///< the program's
};

/// Ends the parsing as it ends where a required option is not given. For a check of runs().
[[noreturn]] void missing(const std::string& name);

/// The program as its own topmost command; owns all that is declared on it.
class Program : public Command {
 public:
  /// With --version unless that is empty.
  explicit Program(const std::string& description, const std::string& version = "");
  ~Program();

  /// False: help or version was asked for and has been printed. Throws ConfigError for wrong usage.
  bool parse(int argc, const char* const* argv);
  /// The same for a program without commands: of what is wrong the bare words, then `advice`.
  bool parse(int argc, const char* const* argv, const std::string& advice);
  /// What the command that was given does, and gives the exit status of; empty: none was given.
  const std::function<int()>& action() const { return chosen_; }

 private:
  explicit Program(std::unique_ptr<CLI::App> app);

  std::unique_ptr<CLI::App> app_;
  std::function<int()> chosen_;
};

}  // namespace tagwrench::command_line
