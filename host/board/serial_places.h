// Where serial ports are, whose they are and who has them: for choosing one and for messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
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

// A board by its USB identity instead of a path.

struct UsbIdentity {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;  ///< empty: any
};

/// Of "usb:VID:PID[:SERIAL]", numbers in hex; nothing if `text` does not begin with "usb:". Throws
/// ConfigError, naming the `option`, if the rest cannot be read.
std::optional<UsbIdentity> parse_usb_identity(const std::string& text,
                                              const std::string& option = kPortOption);

/// "Arduino Uno", "CH340 (Nano clones)", ...; empty if not known.
std::string_view usb_board_name(std::uint16_t vendor, std::uint16_t product);

/// Device nodes ("/dev/ttyUSB0") of serial ports with this identity, sorted; from sysfs alone, for
/// a loop that waits for a board to come back.
std::vector<std::string> usb_serial_nodes(const UsbIdentity& identity,
                                          const std::string& sysfs = "/sys");

/// The only such node. Throws ConfigError with what is plugged in, drivers or not (as libusb sees
/// the bus), if there is none or more than one.
std::string find_usb_port(const UsbIdentity& identity, const std::string& option = kPortOption);

}  // namespace tagwrench::link
