// 6-DOF pucks on HID: which ones there are, and what their reports say. Pure.
//
// Two layouts are in use; every number is a little-endian int16, most often of +-350 counts.
//   combined   01 X Y Z RX RY RZ (13 bytes)
//   split      01 X Y Z (7), 02 RX RY RZ (7)
// Both have buttons, one bit each, in report 03. Axes are those of the HID usage tables (X right, Y
// toward the user, Z down) unless the device says otherwise.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace tagwrench {

enum class PuckLayout : std::uint8_t { unknown, combined, split };

struct PuckModel {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  PuckLayout layout = PuckLayout::unknown;
  std::string_view name;
};

/// Of 3Dconnexion's pucks, under its own vendor id 256f and under Logitech's 046d; nullptr if not
/// in the table. A puck need not be in it to be read.
const PuckModel* puck_model(std::uint16_t vendor, std::uint16_t product) noexcept;

struct PuckState {
  std::array<std::int16_t, 6> counts{};  ///< X Y Z RX RY RZ
  std::uint32_t buttons = 0;             ///< bit 0 is the first button
};

/// Tells the layout from the reports themselves: a device may speak another one than its model did.
class PuckDecoder {
 public:
  enum class Change : std::uint8_t {
    none,    ///< another report: the battery, say
    motion,  ///< counts are new; of a split pair, each half is
    buttons,
    stranger,  ///< too short for what its id promises
  };

  /// Any bytes may come, report id first.
  Change take(std::span<const std::uint8_t> report) noexcept;

  const PuckState& state() const noexcept { return state_; }
  PuckLayout layout() const noexcept { return layout_; }

 private:
  void take_axes(std::span<const std::uint8_t> bytes, std::size_t first,
                 std::size_t count) noexcept;

  PuckState state_;
  PuckLayout layout_ = PuckLayout::unknown;
};

constexpr const char* name(PuckLayout layout) {
  switch (layout) {
    case PuckLayout::combined:
      return "combined";
    case PuckLayout::split:
      return "split";
    case PuckLayout::unknown:
      break;
  }
  return "unknown";
}

}  // namespace tagwrench
