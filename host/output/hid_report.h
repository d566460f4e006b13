// HID descriptors and reports as pure bytes: no file descriptors, no clock, no state.
//
// All multi-byte fields are little-endian. Sources: HID 1.11 section 6.2.2 (report descriptor
// items), HID Usage Tables (Multi-axis Controller, axes, LED page), and the report layout of the
// 3Dconnexion SpaceMouse Wireless (256f:c62e).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// X Y Z RX RY RZ in the counts of a device.
using Counts6 = std::array<std::int16_t, 6>;

/// Rounds -1..1 per axis to -limit..limit, clamps; a number that is not finite makes all axes zero.
Counts6 to_counts(const Vector6& motion, int limit_counts) noexcept;

/// What an input device shows of a sample: nothing of one whose status carries no numbers.
struct ShownMotion {
  Counts6 counts{};
  std::uint32_t pressed = 0;  ///< bit 0 is the first button
};
ShownMotion shown_motion(const Sample& sample, int limit_counts) noexcept;

// ---- SpaceMouse

inline constexpr int kSpacemouseLimit_counts = 350;
inline constexpr std::uint8_t kSpacemouseMotionReportId = 1;
inline constexpr std::uint8_t kSpacemouseLedReportId = 4;

using SpacemouseReport = std::array<std::uint8_t, 13>;  ///< report id, then six int16

/// One combined report of six absolute axes (id 1), two buttons (id 3), one LED (output, id 4).
std::span<const std::uint8_t> spacemouse_descriptor() noexcept;
SpacemouseReport spacemouse_report(const Counts6& counts) noexcept;

inline constexpr std::uint8_t kSpacemouseButtonReportId = 3;
inline constexpr int kSpacemouseButtons = 2;
using SpacemouseButtonReport = std::array<std::uint8_t, 3>;  ///< report id, bit 0 the first button
/// Of the pressed ones those that the device has.
SpacemouseButtonReport spacemouse_button_report(std::uint32_t pressed) noexcept;

/// HID axes (X right, Y toward the user, Z down) to spnav axes (x right, y up, z away; rotations
/// right-handed about each), for a vendor id whose axes spacenavd passes straight through.
Counts6 to_spnav_order(const Counts6& hid) noexcept;

/// What to send so that a reader of evdev sees an event: the kernel drops unchanged absolute axes,
/// and a puck held still off-centre would fall silent. Equal to `wanted` unless that repeats `last`
/// off-centre; then the largest axis moves by one count, toward zero but never onto or across it,
/// and never beyond the limit. Zero stays exactly zero.
Counts6 dithered(const Counts6& wanted, const Counts6& last) noexcept;

// ---- Wrench sensor
//
// One input report, always 64 bytes. Application collection: usage 0x10 on vendor page FF00, so
// that the kernel makes a hidraw node and no evdev node. Every field is declared with usage, unit
// and exponent; physical equals logical range.
//
//   offset  type    usage         quantity                     one count (unit, exponent)
//   0       u8      -             report id, 0x20
//   1       i32 x3  GD X Y Z      force X Y Z                  uN    (E111 dyn, -1)
//   13      i32 x3  GD RX RY RZ   torque about X Y Z           uN m  (E121 dyn cm, 1)
//   25      u32 x3  FF00 21..23   force, standard deviation    uN    (E111 dyn, -1)
//   37      u32 x3  FF00 24..26   torque, standard deviation   uN m  (E121 dyn cm, 1)
//   49      u32     FF00 31       capture time, seconds        s     (1001 s, 0)
//   53      u32     FF00 32       capture time, rest of it     us    (1001 s, -6)
//   57      u32     FF00 33       sequence modulo 2^31         1
//   61      u16     FF00 34       frames lost since the last   1     65535: or more
//                                 sample
//   63      u8      FF00 35       status                       0 ok, 1 acquiring, 2 lost,
//                                                              3 doubtful, 4 saturated
//
// GD is the Generic Desktop page.
// Unsigned fields stop at 2^31 - 1, because HID's logical maximum is a signed number and parsers
// differ beyond it. Time counts from the epoch of CLOCK_MONOTONIC. Axes are those of
// `wrench_frame`, not the HID frame. Only status 0 and 4 carry numbers; with every other status
// forces, torques and sigmas are zero.

inline constexpr std::uint8_t kWrenchReportId = 0x20;
inline constexpr std::size_t kWrenchReportSize = 64;
using WrenchReport = std::array<std::uint8_t, kWrenchReportSize>;

std::vector<std::uint8_t> wrench_descriptor();
/// Rounded, clamped to the field. A wrench or sigma that is not finite: zeros and `doubtful`.
WrenchReport wrench_report(const Sample& sample) noexcept;
/// What the watchdog's watchdog sends: zeros, status `lost`.
WrenchReport neutral_wrench_report() noexcept;

}  // namespace tagwrench
