// Through which socket CAD programs reach the puck, and what is between them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/doctor/report.h"

namespace tagwrench {

/// A socket of the spnav protocol.
enum class SpnavServer : std::uint8_t {
  none,       ///< there is nothing at the path
  silent,     ///< something is there, but nobody answers: a left-over, or put there for Blender
  tagwrench,  ///< `tagwrench spnav`, or the one of `tagwrench run --output spnav`
  other,      ///< spacenavd
};

/// Connects, and hangs up.
SpnavServer server_at(const std::filesystem::path& socket);

struct SpnavFacts {
  std::optional<int> spacenavd;  ///< its process id
  SpnavServer system = SpnavServer::none;
  std::string own_path;  ///< where `run --output spnav` serves; empty: nowhere
  SpnavServer own = SpnavServer::none;
  std::string chosen_path;  ///< SPNAV_SOCKET; empty: not set
  SpnavServer chosen = SpnavServer::none;
};

void say_spnav(Report& report, const SpnavFacts& facts);
SpnavFacts look_at_spnav();

/// A CAD program in a sandbox that hides the socket from it.
struct SandboxedProgram {
  std::string name;
  std::string advice;
};

/// Those of flatpak (system's and user's folder of installed applications) and snap.
std::vector<SandboxedProgram> sandboxed_programs(const std::vector<std::filesystem::path>& flatpak,
                                                 const std::filesystem::path& snap);
void say_sandboxes(Report& report);

}  // namespace tagwrench
