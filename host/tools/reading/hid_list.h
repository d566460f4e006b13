// The 6-DOF and wrench HID devices that are plugged in, the choice of one, and what pucks say.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagwrench {

// HID devices that are plugged in, from sysfs. hidapi's list is not for a program that waits while
// devices come and go: up to 0.13 it dies of one that goes while it is looked at.

inline constexpr const char* kHidrawClass = "/sys/class/hidraw";

struct HidUsage {
  std::uint16_t page = 0, usage = 0;
  friend bool operator==(const HidUsage&, const HidUsage&) = default;
};

/// What each top-level collection is for, as far as the descriptor goes (HID 1.11, 6.2.2). Any
/// bytes may come.
std::vector<HidUsage> top_level_usages(std::span<const std::uint8_t> descriptor);

enum class HidKind : std::uint8_t { wrench, puck };

constexpr const char* name(HidKind kind) { return kind == HidKind::wrench ? "wrench" : "6-dof"; }

struct HidNode {
  HidKind kind = HidKind::wrench;
  std::uint16_t vendor = 0, product = 0;
  std::string path;    ///< "/dev/hidraw3"
  std::string serial;  ///< may be empty
  std::string name;    ///< without the manufacturer where the device is on USB

  /// Whether this is the device that `other` was before it was plugged in again, perhaps as another
  /// node.
  bool is_again(const HidNode& other) const {
    return kind == other.kind && vendor == other.vendor && product == other.product &&
           serial == other.serial;
  }
  /// "1209:7a6e tagwrench-0 (/dev/hidraw3)"
  std::string label() const;
};

/// Wrench sensors first, then in the order of their numbers; no device needs to be readable for it
/// to be listed. One that is only half there is left out: it is coming or going. Texts are UTF-8
/// without control characters.
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

// 6-DOF pucks on HID: which ones there are, and what their reports say. Pure.
//
// Two layouts are in use; every number is a little-endian int16, most often of +-350 counts.
//   combined   01 X Y Z RX RY RZ (13 bytes)
//   split      01 X Y Z (7), 02 RX RY RZ (7)
// Both have buttons, one bit each, in report 03. Axes are those of the HID usage tables (X right, Y
// toward the user, Z down) unless the device says otherwise.

struct PuckModel {
  std::uint16_t vendor = 0, product = 0;
  std::string_view layout;  ///< "combined", "split"; "any": not known
  std::string_view name;
};

/// Of 3Dconnexion's pucks, under its own vendor id 256f and under Logitech's 046d; nullptr if not
/// in the table. A puck need not be in it to be read.
const PuckModel* puck_model(std::uint16_t vendor, std::uint16_t product) noexcept;

struct PuckState {
  enum class Change : std::uint8_t {
    none,    ///< another report: the battery, say
    motion,  ///< counts are new; of a split pair, each half is
    buttons,
    stranger,  ///< too short for what its id promises
  };

  std::array<std::int16_t, 6> counts{};  ///< X Y Z RX RY RZ
  std::uint32_t buttons = 0;             ///< bit 0 is the first button

  /// Any bytes may come, report id first. The layout is told from the reports themselves: a device
  /// may speak another one than its model did.
  Change take(std::span<const std::uint8_t> report) noexcept;
};

}  // namespace tagwrench
