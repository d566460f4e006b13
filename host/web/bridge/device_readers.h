// Which programs read our virtual devices: the kernel tells by their open files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tagwrench {

struct DeviceReader {
  std::string program;
  std::string by;  ///< "hidraw" or "evdev"
  bool operator==(const DeviceReader&) const = default;
};

/// Where the kernel tells it.
struct KernelFolders {
  std::filesystem::path processes = "/proc";
  std::filesystem::path hidraw = "/sys/class/hidraw";
  std::filesystem::path input = "/sys/class/input";
};

/// Of devices whose serial number is `serial`, or whose name begins with "tagwrench": programs of
/// the same user, but not this one, in the order of their names.
std::vector<DeviceReader> device_readers(const std::string& serial,
                                         const KernelFolders& folders = {});

}  // namespace tagwrench
