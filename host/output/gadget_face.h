// What another computer sees of a gadget: a SpaceMouse, or the sensor in newtons.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

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

}  // namespace tagwrench
