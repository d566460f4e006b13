#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/output/spnav_link.h"
#include "host/tools/doctor/doctor.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

bool present(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::optional<int> process_named(std::string_view name) {
  std::error_code error;
  fs::directory_iterator it("/proc", error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string folder = it->path().filename().string();
    int pid = 0;
    const auto [end, bad] = std::from_chars(folder.data(), folder.data() + folder.size(), pid);
    if (bad != std::errc{} || end != folder.data() + folder.size()) continue;
    std::ifstream file(it->path() / "comm");
    std::string comm;
    if (std::getline(file, comm) && comm == name) return pid;
  }
  return std::nullopt;
}

void say_system_socket(Report& report, const SpnavFacts& facts) {
  switch (facts.system) {
    case SpnavServer::tagwrench:
      report.line(Mark::ok,
                  fmt::format("CAD programs reach tagwrench itself by {}", kSpnavSystemSocket));
      return;
    case SpnavServer::other:
      report.line(Mark::ok, facts.spacenavd ? fmt::format("spacenavd runs (pid {}), socket {}",
                                                          *facts.spacenavd, kSpnavSystemSocket)
                                            : fmt::format("a server of CAD programs answers at {}",
                                                          kSpnavSystemSocket));
      return;
    case SpnavServer::none:
    case SpnavServer::silent:
      break;
  }
  if (facts.spacenavd) {
    report.line(Mark::missing,
                fmt::format("spacenavd runs (pid {}) but does not answer at {}: sudo systemctl "
                            "restart spacenavd",
                            *facts.spacenavd, kSpnavSystemSocket));
  } else if (facts.own != SpnavServer::tagwrench) {
    report.line(Mark::absent,
                "spacenavd does not run; FreeCAD, Blender and others need it (sudo apt install "
                "spacenavd), or `tagwrench run --output spnav`");
  } else {
    report.line(Mark::absent, "spacenavd does not run; the next line says what does");
  }
}

}  // namespace

SpnavServer server_at(const fs::path& socket) {
  if (!present(socket)) return SpnavServer::none;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.native().size() >= sizeof address.sun_path) return SpnavServer::silent;
  std::memcpy(address.sun_path, socket.c_str(), socket.native().size());
  const UniqueFd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!probe ||
      ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return SpnavServer::silent;
  }
  // The bridge's own socket lies beside a daemon's.
  return present(socket.string() + ".bridge") ? SpnavServer::tagwrench : SpnavServer::other;
}

void say_spnav(Report& report, const SpnavFacts& facts) {
  say_system_socket(report, facts);
  const bool own = facts.own == SpnavServer::tagwrench && facts.own_path != kSpnavSystemSocket;
  if (own) {
    report.line(Mark::ok,
                fmt::format("programs started with SPNAV_SOCKET={} reach tagwrench itself",
                            facts.own_path));
  }
  if (facts.chosen_path.empty()) {
    if (own && facts.system != SpnavServer::tagwrench && facts.system != SpnavServer::other) {
      report.line(
          Mark::absent,
          fmt::format("SPNAV_SOCKET is not set here, so programs use {}: put SPNAV_SOCKET={} "
                      "into ~/.config/environment.d/tagwrench.conf and log in again",
                      kSpnavSystemSocket, facts.own_path));
    }
  } else if (facts.chosen == SpnavServer::none || facts.chosen == SpnavServer::silent) {
    report.line(Mark::missing,
                fmt::format("SPNAV_SOCKET={}: nobody answers there, so programs started from here "
                            "find no puck; run `tagwrench run --output spnav`, or unset it",
                            facts.chosen_path));
  }
}

SpnavFacts look_at_spnav() {
  SpnavFacts facts;
  facts.spacenavd = process_named("spacenavd");
  facts.system = server_at(kSpnavSystemSocket);
  try {
    facts.own_path = spnav_socket_path("");
    facts.own = server_at(facts.own_path);
  } catch (const ConfigError&) {
    facts.own_path.clear();  // no such place: `run --output spnav` says why
  }
  facts.chosen_path = environment("SPNAV_SOCKET");
  if (!facts.chosen_path.empty()) facts.chosen = server_at(facts.chosen_path);
  return facts;
}

std::vector<SandboxedProgram> sandboxed_programs(const std::vector<fs::path>& flatpak,
                                                 const fs::path& snap) {
  struct Known {
    const char* name;
    const char* application;  // of flatpak
    const char* snap;
  };
  constexpr std::array<Known, 5> kKnown = {{{"FreeCAD", "org.freecad.FreeCAD", "freecad"},
                                            {"FreeCAD", "org.freecadweb.FreeCAD", nullptr},
                                            {"Blender", "org.blender.Blender", "blender"},
                                            {"OpenSCAD", "org.openscad.OpenSCAD", "openscad"},
                                            {"KiCad", "org.kicad.KiCad", nullptr}}};
  std::vector<SandboxedProgram> found;
  for (const Known& known : kKnown) {
    for (const fs::path& folder : flatpak) {
      if (!present(folder / known.application)) continue;
      found.push_back(
          {fmt::format("{} of flatpak", known.name),
           fmt::format("`tagwrench run --output spnav`, and once: flatpak override --user "
                       "--filesystem=xdg-run/tagwrench "
                       "--env=SPNAV_SOCKET=$XDG_RUNTIME_DIR/tagwrench/spnav.sock {}",
                       known.application)});
      break;
    }
    if (known.snap != nullptr && present(snap / known.snap)) {
      found.push_back({fmt::format("{} of snap", known.name),
                       "a snap may not use sockets of others: install it from Debian or as an "
                       "AppImage"});
    }
  }
  return found;
}

void say_sandboxes(Report& report) {
  const fs::path home = environment("HOME");
  for (const SandboxedProgram& program :
       sandboxed_programs({"/var/lib/flatpak/app", home / ".local/share/flatpak/app"}, "/snap")) {
    report.line(Mark::absent, fmt::format("{} does not see the puck by itself: {}", program.name,
                                          program.advice));
  }
}

}  // namespace tagwrench
