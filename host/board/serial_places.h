// Where serial ports are, whose they are and who has them: for choosing one and for messages.
#pragma once

#include <string>
#include <vector>

namespace tagwrench::link {

constexpr const char* kPortOption = "--port";  ///< of the command line
constexpr const char* kStablePorts = "/dev/serial/by-id";

/// Stable paths of all serial ports with a USB identity, sorted; of the folder that udev keeps.
std::vector<std::string> stable_ports(const std::string& folder = kStablePorts);

/// "give --port one of: ...", or that nothing is plugged in. `option` is what the port was named
/// by.
std::string port_advice(const std::string& option = kPortOption,
                        const std::string& folder = kStablePorts);

/// Why a file that exists may not be opened, and the remedy: its group, if that may, or its owner.
std::string permission_advice(const std::string& path);

/// Name of the file's group; its number if it has no name; "?" if there is no such file.
std::string group_of(const std::string& path);

/// "tagwrench (process 4711)": the first other process that has this device open, as far as this
/// user may look; empty if none is seen.
std::string holder_of(const std::string& path);

/// The only stable port. Throws ConfigError if there is none or more than one.
std::string only_port(const std::string& option = kPortOption,
                      const std::string& folder = kStablePorts);

}  // namespace tagwrench::link
