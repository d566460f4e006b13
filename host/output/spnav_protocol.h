// The spnav protocol, versions 0 and 1, as pure bytes: what programs that use libspnav hear, and
// what they may ask. No file descriptors, no clock.
//
// A stream socket in host byte order. Version 0 knows records from the server (motion, press,
// release) and one word from the client, a sensitivity. A client that sends the word 7faa5501 and
// gets it back speaks version 1: besides, device events, and requests of 32 bytes, each answered by
// a record of the same type with a status in its last word. Source: libspnav 1.0, spacenavd 1.1.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "host/core/types.h"
#include "host/output/hid_report.h"

namespace tagwrench {

/// Every event, request and answer: a type and seven words.
using SpnavRecord = std::array<std::int32_t, 8>;

/// Full scale, as spacenavd gives it: it stretches the +-350 counts of a device to +-500.
inline constexpr int kSpnavFullScale_counts = 500;
/// More would be of no use: programs know 12 to 15.
inline constexpr int kSpnavButtons = 16;

/// What the puck shows: x y z rx ry rz in spnav's axes (x right, y up, z away from the user,
/// rotations right-handed about each), and the pressed buttons, bit 0 is the first.
struct SpnavState {
  Counts6 motion{};
  std::uint32_t buttons = 0;

  bool off_centre() const noexcept { return motion != Counts6{}; }
  bool operator==(const SpnavState&) const = default;
};

/// Motion -1..1 in the HID frame as counts in spnav's axes, rounded and clamped; zeros if a number
/// is not finite.
Counts6 spnav_counts(const Vector6& motion) noexcept;

/// What clients may ask of the device.
struct SpnavDevice {
  std::array<char, 64> name{};  ///< ends with a zero
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
};

/// `period_ms`: since the motion before.
SpnavRecord spnav_motion(const Counts6& counts, float sensitivity, std::int32_t period_ms) noexcept;
SpnavRecord spnav_button(int button, bool pressed) noexcept;
SpnavRecord spnav_device(bool added, const SpnavDevice& device) noexcept;

/// What one client has said, and the answers it gets.
class SpnavDialogue {
 public:
  enum Events : std::uint32_t { kMotion = 1, kButton = 2, kDevice = 4 };

  /// The longest answer, a string of 107 bytes.
  static constexpr std::size_t kMaxAnswers = 5;

  /// Bytes that are missing of the next word or request, 1 to 32.
  std::size_t wanted() const noexcept { return (version_ == 0 ? 4 : 32) - held_; }

  /// Takes at most wanted() bytes. Returns the bytes to be sent in return, valid until the next
  /// call. `device` is null while there is none; `path` is what is told as the device's path.
  std::span<const std::uint8_t> take(std::span<const std::uint8_t> bytes, const SpnavDevice* device,
                                     std::string_view path) noexcept;

  /// Whether a whole word has come.
  bool has_spoken() const noexcept { return spoken_; }
  int version() const noexcept { return version_; }
  /// Whether the client wants events of this kind.
  bool wants(Events event) const noexcept { return (event_mask_ & event) != 0; }
  float sensitivity() const noexcept { return sensitivity_; }

 private:
  using Bytes = std::span<const std::uint8_t>;
  Bytes take_word() noexcept;
  Bytes answer(const SpnavDevice* device, std::string_view path) noexcept;
  Bytes reply(std::int32_t status) noexcept;
  Bytes reply_text(std::string_view text) noexcept;
  bool set_sensitivity(float sensitivity) noexcept;

  int version_ = 0;
  bool spoken_ = false;
  std::uint32_t event_mask_ = kMotion | kButton;
  float sensitivity_ = 1;
  std::array<std::uint8_t, 32> input_{};
  std::size_t held_ = 0;  ///< bytes of input_
  SpnavRecord request_{};
  std::array<SpnavRecord, kMaxAnswers> answers_{};
};

}  // namespace tagwrench
