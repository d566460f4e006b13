// Room output: where samples go.
// In:  Sample: displacement (m, rad), wrench (N, N m), deflection (-1..1, HID axes), buttons.
// Out: HID and uinput devices, a USB gadget, sockets, lines of text. A status that carries no
//      numbers is neutral everywhere. Formats: docs/outputs.md.
// Then: hid_report.h (bytes), watchdog.h (devices to rest when the program is not there),
// line_outputs.h.
//
// Where samples go: every sample to those who want data, motion and buttons to input devices. None
// blocks, none queues.
#pragma once

#include <string>
#include <string_view>

#include "host/core/types.h"

namespace tagwrench {

enum class SendStatus : std::uint8_t {
  ok,
  skipped,  ///< the reader is slow: this sample is lost to it, and the gap in `seq` shows it
  failed,   ///< the output is gone for good; failure() says why and what to do
};

/// Setup (the constructors of implementations) throws ConfigError; the running loop gets statuses.
class Output {
 public:
  Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  /// Leaves nothing behind: input devices send neutral before they go, files end on a whole line.
  virtual ~Output() = default;

  /// Every sample, once. One whose status does not carry numbers is a neutral output: zeros.
  virtual SendStatus send(const Sample&) noexcept { return SendStatus::ok; }

  /// What input devices show: Sample::deflection and Sample::buttons. With every sample, or at a
  /// rate of its own, then with what the motion is at that time. Neutral as above.
  virtual SendStatus move(const Sample&) noexcept { return SendStatus::ok; }

  /// One line about the last failed send() or move().
  virtual std::string failure() const { return {}; }

  /// Readable when service() has something to answer (a client's LED report); -1: never.
  virtual int poll_fd() const noexcept { return -1; }
  /// Answers. What a client has changed, in words for people; empty if nothing.
  virtual std::string_view service() noexcept { return {}; }

  /// Buttons that this output knows of and that are pressed now, bit 0 is the first.
  virtual std::uint32_t pressed() const noexcept { return 0; }

  /// Offers a line for people; true if this output has shown it. An empty one takes the last away.
  virtual bool notice(std::string_view) noexcept { return false; }
};

// What an output may show of a sample: one rule for all of them.

/// The sample's status, but `doubtful` where a number that it would carry is not finite: an output
/// never passes on a NaN and never makes up a number in its place.
inline Status shown_status(const Sample& sample) {
  if (!carries_numbers(sample.status)) return sample.status;
  const bool finite = sample.displacement.allFinite() && sample.displacement_sigma.allFinite() &&
                      sample.wrench.allFinite() && sample.wrench_sigma.allFinite() &&
                      sample.deflection.allFinite();
  return finite ? sample.status : Status::doubtful;
}

}  // namespace tagwrench
