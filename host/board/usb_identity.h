// A board by its USB identity instead of a path.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/board/serial_places.h"

namespace tagwrench::link {

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
