// A six-axis joystick for games (SDL, Gamepad API) through /dev/uinput (Linux
// Documentation/input/uinput.rst).
#pragma once

#include <linux/input.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/hid_report.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

inline constexpr int kJoystickLimit_counts = 32767;

struct JoystickOptions {
  /// pid.codes; a placeholder like the wrench sensor's. Games remember their bindings by this id.
  std::uint16_t vendor = 0x1209;
  std::uint16_t product = 0x7a6f;
  std::string name = "tagwrench joystick";  ///< 1..79 bytes, printable
};

inline constexpr std::size_t kJoystickButtons = 8;

/// ABS_X to ABS_RZ, the buttons (bit 0 of `pressed` is the first), and the SYN_REPORT that makes
/// them one frame.
using JoystickEvents = std::array<input_event, 6 + kJoystickButtons + 1>;
JoystickEvents joystick_events(const Counts6& counts, std::uint32_t pressed) noexcept;

/// Sends Sample::deflection as +-32767, and the buttons. No dither: games read the state of an
/// axis, not its events.
class JoystickOutput : public Output {
 public:
  /// Throws ConfigError if /dev/uinput is not usable.
  explicit JoystickOutput(const JoystickOptions& options);
  ~JoystickOutput() override;

  SendStatus move(const Sample& sample) noexcept override;
  std::string failure() const override;

  void add_to(std::vector<WatchdogDevice>& devices) const;

 private:
  UniqueFd uinput_;
  int error_ = 0;
};

}  // namespace tagwrench
