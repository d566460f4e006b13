// Devices that a service of this computer makes for its users.
//
// Whoever may open /dev/uhid or /dev/uinput can make a keyboard and type. So the package opens them
// to one system user alone, whose service (device_service_main.cpp) makes tagwrench's devices for
// others and passes their reports on. A connection to one of its sockets stands for the node of
// that name: the same bytes go over it, a message is an event, and what tagwrench would not write
// ends the connection, and with it the device.
#pragma once

#include <linux/uhid.h>
#include <linux/uinput.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

/// A node that makes virtual devices; `name` is that of its kernel module and of its socket, too.
struct DeviceNode {
  const char* name;
  std::string path() const { return std::string("/dev/") + name; }
};
inline constexpr DeviceNode kUhidNode{"uhid"};
inline constexpr DeviceNode kUinputNode{"uinput"};

inline constexpr const char* kDeviceServiceFolder = "/run/tagwrench-devices";
/// Its members may have devices made without sitting at the computer.
inline constexpr const char* kDeviceGroup = "tagwrench";

struct OpenedNode {
  UniqueFd fd;        ///< close-on-exec, does not block
  bool lent = false;  ///< a connection to the service
};

/// Opens the node, or, without permission for it, a connection to the service, whose sockets are in
/// `folder`. Throws ConfigError with the remedy: no node, neither permission nor service, or the
/// service refuses this user.
OpenedNode open_device_node(const DeviceNode& node,
                            const std::string& folder = kDeviceServiceFolder);

/// One line about a node that does not open: path, cause, remedy.
std::string cannot_open_node(const DeviceNode& node, int error);

/// What the service says of a connection, and of a joystick that it was asked for: an errno, of
/// which EACCES means that this user may not; 0: it is done. One message.
using DeviceAnswer = std::int32_t;

/// Waits for the service's next answer; ETIMEDOUT, EPIPE: there came none.
DeviceAnswer device_answer(int connection);

// What of a connection reaches the node. Pure.

/// Whether the service lends a SpaceMouse or a wrench sensor of this id: clients' SpaceMouse and
/// all of pid.codes. Others might be given to a driver of the kernel that was written for hardware.
constexpr bool lent_id(std::uint32_t vendor, std::uint32_t product) noexcept {
  return (vendor == 0x256f && product == 0xc62e) || vendor == 0x1209;
}

class UhidGate {
 public:
  /// Whether these bytes, an event, may be written to /dev/uhid: at first a device as UhidDevice
  /// creates it, then reports of it and answers for it, at last its end.
  bool passes(std::span<const std::uint8_t> event) noexcept;

  bool created() const noexcept { return created_; }
  bool ended() const noexcept { return ended_; }
  /// What brings the device to rest, a write each.
  const std::vector<std::vector<std::uint8_t>>& neutral() const noexcept { return neutral_; }

 private:
  bool is_ours(const uhid_create2_req& asked);

  bool created_ = false;
  bool ended_ = false;
  std::vector<std::vector<std::uint8_t>> neutral_;
};

/// The joystick that is asked for, if it is one as JoystickOutput makes it.
std::optional<uinput_setup> lent_joystick(std::span<const std::uint8_t> bytes) noexcept;

/// Whether these bytes are one frame of a joystick, as JoystickOutput writes it.
bool is_joystick_frame(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace tagwrench
