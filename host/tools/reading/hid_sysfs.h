// HID devices that are plugged in, from sysfs. hidapi's list is not for a program that waits while
// devices come and go: up to 0.13 it dies of one that goes while it is looked at.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tagwrench {

inline constexpr const char* kHidrawClass = "/sys/class/hidraw";

struct HidUsage {
  std::uint16_t page = 0;
  std::uint16_t usage = 0;
  friend bool operator==(const HidUsage&, const HidUsage&) = default;
};

struct HidInterface {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string path;              ///< "/dev/hidraw3"
  std::string serial;            ///< may be empty
  std::string name;              ///< without the manufacturer where the device is on USB
  std::vector<HidUsage> usages;  ///< of its top-level collections
};

/// What each top-level collection is for, as far as the descriptor goes (HID 1.11, 6.2.2). Any
/// bytes may come.
std::vector<HidUsage> top_level_usages(std::span<const std::uint8_t> descriptor);

/// In the order of their numbers. A device that is only half there is left out: it is coming or
/// going. Texts are UTF-8 without control characters.
std::vector<HidInterface> hid_interfaces(const std::filesystem::path& hidraw_class);

}  // namespace tagwrench
