// Where serial ports are, whose they are and who has them: for choosing one and for messages.
#pragma once

#include <string>
#include <vector>

namespace tagwrench::link {

/// Stable paths of all serial ports with a USB identity, sorted; of the folder that udev keeps.
std::vector<std::string> stable_ports(const std::string& folder = "/dev/serial/by-id");

/// "give one of: ...", or that nothing is plugged in.
std::string port_advice(const std::string& folder = "/dev/serial/by-id");

/// Name of the file's group; its number if it has no name; "?" if there is no such file.
std::string group_of(const std::string& path);

/// "tagwrench (process 4711)": the first other process that has this device open, as far as this
/// user may look; empty if none is seen.
std::string holder_of(const std::string& path);

/// The only stable port. Throws ConfigError if there is none or more than one.
std::string only_port(const std::string& folder = "/dev/serial/by-id");

}  // namespace tagwrench::link
