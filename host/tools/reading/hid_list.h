// The 6-DOF and wrench HID devices that are plugged in, and the choice of one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tagwrench {

// HID devices that are plugged in, from sysfs. hidapi's list is not for a program that waits while
// devices come and go: up to 0.13 it dies of one that goes while it is looked at.

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

enum class HidKind : std::uint8_t { wrench, puck };

constexpr const char* name(HidKind kind) { return kind == HidKind::wrench ? "wrench" : "6-dof"; }

struct HidNode {
  HidKind kind = HidKind::wrench;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string path;    ///< "/dev/hidraw3"
  std::string serial;  ///< may be empty
  std::string name;

  /// Whether this is the device that `other` was before it was plugged in again, perhaps as another
  /// node.
  bool is_again(const HidNode& other) const {
    return kind == other.kind && vendor == other.vendor && product == other.product &&
           serial == other.serial;
  }
  /// "1209:7a6e tagwrench-0 (/dev/hidraw3)"
  std::string label() const;
};

/// Wrench sensors first; no device needs to be readable for it to be listed.
std::vector<HidNode> hid_nodes(const std::filesystem::path& hidraw_class);

/// What a person names a device by. Empty: the only one, or the wrench sensor beside pucks.
class HidChoice {
 public:
  /// A path, VID:PID in hex, or a serial.
  explicit HidChoice(const std::string& text);

  /// Nothing if no device fits. Throws ConfigError if several do: a wrench sensor goes before pucks
  /// of the same serial, but nothing else is guessed.
  std::optional<HidNode> among(const std::vector<HidNode>& nodes) const;

  /// For messages: "wrench sensor or 6-DOF device", with what was asked for.
  std::string words() const;

 private:
  bool fits(const HidNode& node) const;

  std::string text_;
  bool path_ = false;
  std::optional<std::pair<std::uint16_t, std::uint16_t>> id_;
};

}  // namespace tagwrench
