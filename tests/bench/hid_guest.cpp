#include "tests/bench/hid_guest.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

namespace tagwrench::bench {
namespace {

constexpr int kSkipped = 77;

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream in(line);
  for (std::string word; std::getline(in, word, '|');) words.push_back(word);
  return words;
}

/// `line|TEXT`, or `at_most|TEXT|VALUE|LIMIT|UNIT` and at_least likewise.
void take(Table& table, const std::string& line, std::string& rest) {
  const std::vector<std::string> words = words_of(line);
  const bool verdict = words.size() == 5 && (words[0] == "at_most" || words[0] == "at_least");
  if (verdict) {
    const double value = std::strtod(words[2].c_str(), nullptr);
    const double limit = std::strtod(words[3].c_str(), nullptr);
    if (words[0] == "at_most") {
      table.at_most(words[1], value, limit, words[4]);
    } else {
      table.at_least(words[1], value, limit, words[4]);
    }
  } else if (words.size() == 2 && words[0] == "line") {
    table.line(words[1]);
  } else {
    rest += line + "\n";
  }
}

/// Runs a shell command; its exit status. Each line of its output is taken.
template <typename Take>
int run_lines(const std::string& command, Take taken) {
  std::FILE* out = ::popen(command.c_str(), "r");
  if (out == nullptr) return 1;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), out) != nullptr) {
    std::string line = buffer.data();
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
    taken(line);
  }
  const int status = ::pclose(out);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

void bench_guest(Table& table) {
  const std::string source = TAGWRENCH_SOURCE_DIR;
  const std::string build = TAGWRENCH_BUILD_DIR;
  const std::string rig = build + "/kernel-rig";
  const std::string frames = build + "/tests/kernel/frames";
  for (const char* client : {"feeder", "spnav_client", "hid_client", "sdl_client"}) {
    if (std::filesystem::exists(build + "/tests/kernel/" + client)) continue;
    table.skipped("guest", std::string(client) +
                               " was not built: install libspnav-dev libhidapi-dev libsdl2-dev");
    return;
  }
  std::string said;
  const auto remember = [&](const std::string& line) { said = line; };
  const int rendered = run_lines(fmt::format("'{}/tests/kernel/render.py' '{}' '{}' '{}' 2>&1",
                                             source, TAGWRENCH_PROGRAM, frames, rig),
                                 remember);
  if (rendered != 0) {
    table.skipped("guest", said);
    return;
  }
  std::string accelerator;
  run_lines(fmt::format("cat '{}/accelerator'", rig),
            [&](const std::string& line) { accelerator = line; });
  const bool emulated = accelerator.compare(0, 3, "tcg") == 0;
  table.open(
      "guest",
      {std::string("Debian's kernel in QEMU, ") +
           (emulated
                ? "EMULATED: some twenty times slower than a computer. Ratios carry over, times "
                  "do not."
                : "on KVM."),
       "320x240 GREY from v4l2loopback, 8 fps, to unmodified clients. Latency from the driver's "
       "time stamp."});
  std::string rest;
  const int status = run_lines(
      fmt::format("'{0}/tests/kernel/vm' -t 240 '{1}' python3 -B '{0}/tests/bench/hid_guest.py' "
                  "--tagwrench '{2}' --programs '{3}/tests/kernel' --frames '{4}' --source-dir "
                  "'{0}' 2>&1",
                  source, rig, TAGWRENCH_PROGRAM, build, frames),
      [&](const std::string& line) { take(table, line, rest); });
  if (status == kSkipped) {
    table.skipped("guest", rest);
  } else if (status != 0) {
    table.line("the guest's part did not run to its end: " + rest);
    table.at_most("guest: exit status", status, 0, "");
  }
}

}  // namespace tagwrench::bench
