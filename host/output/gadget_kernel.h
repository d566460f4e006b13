// What the kernel has to have for a gadget, and the character device that it gives us for it.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/gadget_tree.h"

namespace tagwrench {

/// Where the kernel shows itself; a test has its own.
struct KernelPlaces {
  std::string configfs = "/sys/kernel/config";
  std::string sysfs = "/sys";
  std::string devices = "/dev";

  std::string gadgets() const { return configfs + "/usb_gadget"; }
};

/// A USB device controller: the hardware of a port that can be plugged into another computer.
struct Controller {
  std::string name;   ///< "fe980000.usb"
  std::string state;  ///< "not attached", "configured", "suspended", ... of the other end
  std::string speed;  ///< "high-speed", ...
  std::string owner;  ///< the gadget or driver that has it; empty: free
};
std::vector<Controller> controllers(const GadgetFiles& files, const KernelPlaces& places,
                                    const std::vector<GadgetFound>& gadgets);

/// The one with this name, or without a name the first that is free or `ours` already. Throws
/// ConfigError: there is none, not this one, or another gadget has it.
Controller choose_controller(const std::vector<Controller>& all, const std::string& wanted,
                             const std::string& ours);

/// Runs a program to its end; true if that was a success.
using RunProgram = std::function<bool(const std::vector<std::string>& arguments)>;
bool run_program(const std::vector<std::string>& arguments);

/// Loads libcomposite and mounts configfs where they are missing and may be had. Throws ConfigError
/// with the command where they are not.
void prepare_kernel(const GadgetFiles& files, const KernelPlaces& places, const RunProgram& run);

/// One gadget command at a time, as long as this is open. Throws ConfigError.
UniqueFd lock_gadgets(const KernelPlaces& places);

/// Of the attribute `dev`: "236:0".
std::optional<dev_t> parse_device_number(std::string_view text) noexcept;

/// The name in /dev of the character device of a HID function ("hidg0"), by the number that its
/// attribute `dev` gives; nothing if it has none, or none that could be one.
std::optional<std::string> gadget_node(const GadgetFiles& files, const KernelPlaces& places,
                                       const std::string& function);

struct OpenedNode {
  UniqueFd fd;       ///< O_NONBLOCK, locked: one writer at a time
  std::string path;  ///< what was tried; empty: the function has no node now
  int error = 0;     ///< why `fd` is none; EWOULDBLOCK: another bridge writes to it
};
OpenedNode open_gadget_node(const GadgetFiles& files, const KernelPlaces& places,
                            const std::string& function);

}  // namespace tagwrench
