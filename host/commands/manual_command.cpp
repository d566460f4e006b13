// What the package and the shells ask of the program: `tagwrench manual` writes its man pages,
// `tagwrench complete` says what may be typed next. Not for people, so no help names them.
#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <vector>

#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/motion/profile_config.h"
#include "host/tools/packaging/man_page.h"

namespace tagwrench {
namespace {

struct ManualOptions {
  std::string folder;
  std::vector<std::string> typed;
};

void write_pages(command_line::Command program, const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(folder, error);
  for (const ManPage& page : man_pages(program, TAGWRENCH_VERSION)) {
    const fs::path path = fs::path(folder) / (page.name + ".1");
    std::ofstream file(path);
    file << page.text;
    file.close();
    if (!file)
      throw ConfigError("{}: cannot be written; choose a folder of yours with --out",
                        path.string());
  }
}

/// First whether files fit and behind which words, then what may come, a line each.
void print_completion(command_line::Command program, const std::vector<std::string>& typed) {
  std::vector<std::string> profiles;
  for (const ReadyProfile& profile : ready_profiles()) profiles.emplace_back(profile.name);
  const Completion found = complete(program, typed, profiles);
  fmt::print("{} {}\n", found.files ? "files" : "none", found.before_file);
  for (const std::string& word : found.words) fmt::print("{}\n", word);
}

}  // namespace

void manual_command(command_line::Command program) {
  const auto o = std::make_shared<ManualOptions>();
  auto manual = program.add_subcommand("manual", "write the man pages").hidden();
  manual.add_option("--out", o->folder, "folder to write").required();
  manual.runs([=] {
    write_pages(program, o->folder);
    return 0;
  });
  auto complete = program.add_subcommand("complete", "what may be typed next").hidden();
  complete.add_option("typed", o->typed, "the words behind the program's name, behind --");
  complete.runs([=] {
    print_completion(program, o->typed);
    return 0;
  });
}

}  // namespace tagwrench
