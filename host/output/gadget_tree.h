// A USB gadget of ours in configfs (Linux Documentation/usb/gadget_configfs.rst): made step by
// step, taken away step by step, found again after a crash.
//
// All gadgets of ours are named tagwrench-NAME, and nothing outside of such a folder is ever
// written. Its one function is named after the face: hid.spacemouse or hid.wrench.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

// What another computer sees of a gadget: a SpaceMouse, or the sensor in newtons.

enum class GadgetFace : std::uint8_t { spacemouse, wrench };

/// "spacemouse", "wrench"
std::string_view face_name(GadgetFace face) noexcept;
std::optional<GadgetFace> face_of(std::string_view name) noexcept;

/// The USB product string; with the manufacturer's it makes the names that the uhid devices have.
std::string_view face_product(GadgetFace face) noexcept;
inline constexpr std::string_view kGadgetManufacturer = "tagwrench";

struct UsbId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
};
UsbId face_id(GadgetFace face) noexcept;

std::vector<std::uint8_t> face_descriptor(GadgetFace face);
/// Of the longest input report, report id included.
std::size_t face_report_length(GadgetFace face) noexcept;

inline constexpr std::string_view kGadgetPrefix = "tagwrench-";

/// The file system as gadgets need it. Paths are absolute; numbers returned are 0 or an errno.
class GadgetFiles {
 public:
  GadgetFiles() = default;
  GadgetFiles(const GadgetFiles&) = delete;
  GadgetFiles& operator=(const GadgetFiles&) = delete;
  virtual ~GadgetFiles() = default;

  virtual int make_folder(const std::string& path);
  virtual int remove_folder(const std::string& path);
  /// In one write(), as attributes want it.
  virtual int write(const std::string& path, std::string_view bytes);
  virtual int link(const std::string& target, const std::string& path);
  virtual int unlink(const std::string& path);

  /// Names, sorted; none if there is no such folder.
  std::vector<std::string> list(const std::string& path) const;
  bool exists(const std::string& path) const;
  /// The first line, at most 255 characters, all printable; empty if it cannot be read.
  std::string line(const std::string& path) const;
};

struct GadgetSpec {
  std::string name;  ///< of the sensor; the gadget and its serial number are tagwrench-NAME
  GadgetFace face = GadgetFace::spacemouse;
  UsbId id;
  bool self_powered = false;  ///< the board has a supply of its own
  std::string udc;            ///< the controller
};

/// What configfs tells of a gadget.
struct GadgetFound {
  std::string folder;  ///< "tagwrench-sensor", or whatever another's is called
  std::optional<GadgetFace> face;
  UsbId id;
  std::string serial;
  std::string udc;  ///< empty: bound to none
  bool self_powered = false;
  bool whole = false;  ///< and bound

  /// Ours: the name without the prefix.
  std::optional<std::string> name() const;
};

class GadgetTree {
 public:
  /// `root` is configfs's usb_gadget folder. Borrows `files`.
  GadgetTree(GadgetFiles& files, std::string root);

  std::vector<GadgetFound> all() const;
  /// Ours of this name, half made or whole.
  std::optional<GadgetFound> find(std::string_view name) const;
  /// Where its HID function is; the attribute `dev` there names the character device.
  std::string function(std::string_view name, GadgetFace face) const;

  /// Makes it and binds it to its controller; what is left over of an earlier one goes first.
  /// Throws ConfigError, and then nothing of it is left.
  void up(const GadgetSpec& spec);

  /// Takes it away, whole or half made; done if it is not there. Throws ConfigError if any stays.
  void down(std::string_view name);

 private:
  std::string path(std::string_view name) const;
  void make(const GadgetSpec& spec);
  int remove(const std::string& gadget);
  void need(int error, const std::string& what) const;
  GadgetFound look(const std::string& folder) const;

  GadgetFiles& files_;
  std::string root_;
};

/// "256f:c62e"
std::optional<UsbId> parse_usb_id(std::string_view text) noexcept;

// What the kernel has to have for a gadget, and the character device that it gives us for it.

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
