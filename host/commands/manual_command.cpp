#include "host/commands/manual_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "host/core/config_error.h"
#include "host/motion/profile_config.h"
#include "host/tools/packaging/completion.h"
#include "host/tools/packaging/man_page.h"

namespace tagwrench {

ManualCommand::ManualCommand(command_line::Command program)
    : program_(program),
      manual_(program.add_subcommand("manual", "write the man pages")),
      complete_(program.add_subcommand("complete", "what may be typed next")) {
  manual_.hidden();
  manual_.add_option("--out", folder_, "folder to write").required();
  complete_.hidden();
  complete_.add_option("typed", typed_, "the words behind the program's name, behind --");
}

int ManualCommand::run() const {
  if (manual_.parsed())
    write_pages();
  else
    print_completion();
  return 0;
}

void ManualCommand::write_pages() const {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(folder_, error);
  for (const ManPage& page : man_pages(program_, TAGWRENCH_VERSION)) {
    const fs::path path = fs::path(folder_) / (page.name + ".1");
    std::ofstream file(path);
    file << page.text;
    file.close();
    if (!file)
      throw ConfigError(
          fmt::format("{}: cannot be written; choose a folder of yours with --out", path.string()));
  }
}

/// First whether files fit and behind which words, then what may come, a line each.
void ManualCommand::print_completion() const {
  std::vector<std::string> profiles;
  for (const ReadyProfile& profile : ready_profiles()) profiles.emplace_back(profile.name);
  const Completion found = complete(program_, typed_, profiles);
  fmt::print("{} {}\n", found.files ? "files" : "none", found.before_file);
  for (const std::string& word : found.words) fmt::print("{}\n", word);
}

}  // namespace tagwrench
