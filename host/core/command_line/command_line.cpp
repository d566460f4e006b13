#include "host/core/command_line/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "host/core/config_error.h"

namespace tagwrench::command_line {
namespace {

Check check_of(const CLI::Validator& validator) { return {validator, validator.get_description()}; }

/// What is wrong, and whose help tells more: that of the command which was reached.
std::string usage_error(const CLI::App& program, const CLI::ParseError& error) {
  const CLI::App* reached = &program;
  std::string words = "tagwrench";
  while (!reached->get_subcommands().empty()) {
    reached = reached->get_subcommands().front();
    words += " " + reached->get_name();
  }
  std::string commands;
  for (const CLI::App* command : reached->get_subcommands(
           [](const CLI::App* command) { return !command->get_group().empty(); }))
    commands += (commands.empty() ? "" : ", ") + command->get_name();
  const std::vector<std::string> rest = reached->remaining();
  if (commands.empty() || (!rest.empty() && rest[0][0] == '-'))
    return fmt::format("{}; `{} --help` lists what there is", error.what(), words);
  if (rest.empty())
    return fmt::format("`{0}` needs a subcommand: {1}; see `{0} --help`", words, commands);
  return fmt::format("`{0}` has no subcommand '{1}' but {2}; see `{0} --help`", words, rest[0],
                     commands);
}

/// False: help or version was asked for and has been printed.
bool read(CLI::App& program, int argc, const char* const* argv) {
  try {
    program.parse(argc, argv);
    return true;
  } catch (const CLI::Success& help_or_version) {
    program.exit(help_or_version);
    return false;
  }
}

}  // namespace

Check range(int least, int most) { return check_of(CLI::Range(least, most)); }

Check range(double least, double most) { return check_of(CLI::Range(least, most)); }

Check positive_number() { return check_of(CLI::PositiveNumber); }

Check number(double least, double most, const std::string& what, const std::string& name) {
  return {[=](std::string& text) {
            const std::optional<double> value = to_number(text);
            const bool usable = value && *value >= least && *value <= most;
            return usable ? std::string() : "'" + text + "' is not " + what;
          },
          name};
}

Check seconds() { return number(1e-3, 1e9, "a number of seconds from 0.001 to 1e9", "SECONDS"); }

Check one_of(std::initializer_list<const char*> words) {
  return check_of(CLI::IsMember(std::vector<std::string>(words.begin(), words.end())));
}

Check one_of(std::initializer_list<int> numbers) {
  return check_of(CLI::IsMember(std::vector<int>(numbers)));
}

std::optional<double> to_number(const std::string& text) {
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value)) return {};
  return value;
}

Option Option::required() { return Option(option_->required()); }

Option Option::check(const Check& check) {
  return Option(option_->check(CLI::Validator(check.refusal, check.name)));
}

Option Option::capture_default_str() { return Option(option_->capture_default_str()); }

Option Option::needs(Option other) { return Option(option_->needs(other.option_)); }

Option Option::excludes(Option other) { return Option(option_->excludes(other.option_)); }

Option Option::delimiter(char character) { return Option(option_->delimiter(character)); }

Option Option::expected(int count) { return Option(option_->expected(count)); }

Option Option::expected(int least, int most) { return Option(option_->expected(least, most)); }

Option Option::hidden() { return Option(option_->group("")); }

std::size_t Option::count() const { return option_->count(); }

std::string Option::name() const { return option_->get_name(); }

bool Option::has_name(const std::string& name) const { return option_->check_name(name); }

std::vector<std::string> Option::long_names() const { return option_->get_lnames(); }

std::vector<std::string> Option::short_names() const { return option_->get_snames(); }

std::string Option::description() const { return option_->get_description(); }

std::string Option::value_type() const { return option_->get_type_name(); }

std::string Option::default_text() const { return option_->get_default_str(); }

bool Option::takes_value() const { return option_->get_expected_max() > 0; }

bool Option::is_required() const { return option_->get_required(); }

bool Option::is_positional() const { return option_->get_positional(); }

Command Command::add_subcommand(const std::string& name, const std::string& description) {
  return {app_->add_subcommand(name, description), action_};
}

template <typename Value>
Option Command::add_option(const std::string& name, Value& value, const std::string& description) {
  return Option(app_->add_option(name, value, description));
}

using Text = const std::string&;
template Option Command::add_option(Text, std::string&, Text);
template Option Command::add_option(Text, std::filesystem::path&, Text);
template Option Command::add_option(Text, int&, Text);
template Option Command::add_option(Text, std::size_t&, Text);
template Option Command::add_option(Text, double&, Text);
template Option Command::add_option(Text, std::optional<int>&, Text);
template Option Command::add_option(Text, std::optional<long>&, Text);
template Option Command::add_option(Text, std::optional<double>&, Text);
template Option Command::add_option(Text, std::optional<std::uint8_t>&, Text);
template Option Command::add_option(Text, std::vector<std::string>&, Text);
template Option Command::add_option(Text, std::vector<std::filesystem::path>&, Text);
template Option Command::add_option(Text, std::vector<int>&, Text);
template Option Command::add_option(Text, std::vector<double>&, Text);

Option Command::add_flag(const std::string& name, bool& value, const std::string& description) {
  return Option(app_->add_flag(name, value, description));
}

Command Command::footer(const std::string& text) { return {app_->footer(text), action_}; }

Command Command::require_subcommand() { return {app_->require_subcommand(1), action_}; }

Command Command::hidden() { return {app_->group(""), action_}; }

void Command::runs(std::function<int()> action, std::function<void()> check) {
  app_->callback([action = std::move(action), check = std::move(check), chosen = action_] {
    if (check) check();
    *chosen = action;
  });
}

std::size_t Command::count(const std::string& name) const { return app_->count(name); }

std::string Command::name() const { return app_->get_name(); }

std::string Command::description() const { return app_->get_description(); }

std::string Command::footer_text() const { return app_->get_footer(); }

std::vector<Command> Command::subcommands() const {
  std::vector<Command> commands;
  const auto shown = [](CLI::App* command) { return !command->get_group().empty(); };
  for (CLI::App* command : app_->get_subcommands(shown)) commands.emplace_back(command, action_);
  return commands;
}

std::vector<Option> Command::options() const {
  std::vector<Option> options;
  const auto shown = [](CLI::Option* option) { return !option->get_group().empty(); };
  for (CLI::Option* option : app_->get_options(shown)) options.emplace_back(option);
  return options;
}

void missing(const std::string& name) { throw CLI::RequiredError(name); }

Program::Program(std::unique_ptr<CLI::App> app)
    : Command(app.get(), &chosen_), app_(std::move(app)) {}

Program::Program(const std::string& description, const std::string& version)
    : Program(std::make_unique<CLI::App>(description)) {
  if (!version.empty()) app_->set_version_flag("--version", version);
}

Program::~Program() = default;

bool Program::parse(int argc, const char* const* argv) {
  try {
    return read(*app_, argc, argv);
  } catch (const CLI::ParseError& error) {
    throw ConfigError(usage_error(*app_, error));
  }
}

bool Program::parse(int argc, const char* const* argv, const std::string& advice) {
  try {
    return read(*app_, argc, argv);
  } catch (const CLI::ParseError& error) {
    throw ConfigError(error.what() + advice);
  }
}

}  // namespace tagwrench::command_line
