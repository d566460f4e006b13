// Virtual devices of this computer: a SpaceMouse and a sensor in newtons through /dev/uhid (Linux
// Documentation/hid/uhid.rst), with evdev node, hidraw node and LED back-channel as real USB
// devices have them; a joystick through /dev/uinput. Or through the service that stands for these
// nodes, see device_service.h.
#pragma once

#include <linux/input.h>
#include <linux/uhid.h>
#include <linux/uinput.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/hid_report.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

/// Throws ConfigError unless it can be the name of a sensor, which stands in serial numbers of
/// devices: 1 to 32 letters, digits, - and _.
void check_sensor_name(std::string_view name);

struct UhidIdentity {
  std::string name;    ///< HID_NAME, 1..127 bytes, printable
  std::string serial;  ///< HID_UNIQ, at most 63 bytes; tells two devices of one kind apart
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
};

/// What a client sent to the device, report id first.
struct HidOutputReport {
  std::array<std::uint8_t, 64> bytes{};
  std::size_t size = 0;
};

/// The event that creates the device on BUS_USB. Throws ConfigError: a text or the descriptor does
/// not fit.
std::unique_ptr<uhid_event> uhid_creation(const UhidIdentity& identity,
                                          std::span<const std::uint8_t> descriptor);

/// The event of one input report, report id first, at most 64 bytes.
std::vector<std::uint8_t> uhid_input(std::span<const std::uint8_t> report);

class UhidDevice {
 public:
  /// With its driver loaded, the kernel takes milliseconds; the rest is for a slow machine.
  static constexpr std::chrono::milliseconds kStartTimeout{3000};

  /// Opens /dev/uhid or what stands for it. Throws ConfigError, see open_device_node().
  static UniqueFd open();

  /// Creates the device and waits until the kernel has started it. Throws ConfigError: refused by
  /// the kernel or the service, not started in time.
  UhidDevice(UniqueFd uhid, const UhidIdentity& identity, std::span<const std::uint8_t> descriptor,
             std::chrono::milliseconds start_timeout = kStartTimeout);

  UhidDevice(UhidDevice&&) = default;
  UhidDevice& operator=(UhidDevice&&) = delete;
  /// Destroys the device; the watchdog's duplicate of the fd cannot keep it alive.
  ~UhidDevice();

  /// Sends one input report, report id first, at most 64 bytes. Never blocks, never queues.
  SendStatus send(std::span<const std::uint8_t> report) noexcept;

  /// Answers what the kernel asks, and returns the next output report of a client, if any.
  std::optional<HidOutputReport> next_output() noexcept;

  /// Readable when next_output() has something to do; -1 after the service has gone.
  int fd() const noexcept { return service_gone_ ? -1 : uhid_.get(); }

  /// One line about the last failed send().
  std::string failure() const;

  /// For the watchdog: these input reports, then the device's end.
  WatchdogDevice watchdog_device(
      std::initializer_list<std::span<const std::uint8_t>> neutral) const;

 private:
  void wait_for_start(const UhidIdentity& identity, std::chrono::milliseconds timeout);
  bool read_event() noexcept;
  void answer_get_report() noexcept;

  UniqueFd uhid_;
  std::string label_;  ///< of messages: "/dev/uhid: tagwrench SpaceMouse (256f:c62e)"
  std::unique_ptr<uhid_event> event_;  ///< 4380 bytes, read again and again
  HidOutputReport last_input_;         ///< what GET_REPORT is answered with
  bool service_gone_ = false;
  int error_ = 0;
};

/// "256f:c62e"
std::string hex_id(std::uint16_t vendor, std::uint16_t product);

// A virtual SpaceMouse: spacenavd, hidapi programs and browsers take it for 3Dconnexion's Wireless.

/// SpaceMouse Wireless: one combined report, two buttons. 256f is 3Dconnexion's vendor id, which
/// clients look for. With an own id the axes go out in spnav's order, because spacenavd passes them
/// straight through; see spacenavd_advice().
struct SpacemouseOptions : UhidIdentity {
  SpacemouseOptions() : UhidIdentity{"tagwrench SpaceMouse", "tagwrench-0", 0x256f, 0xc62e} {}
};

/// Sends Sample::deflection as +-350 counts, and buttons when they change. Zero at rest is exact
/// and sent with every move, so that a slow hidraw reader that lost reports still learns of the
/// release. Off-centre every move makes an event (see dithered()). A status that carries no numbers
/// is zeros at once.
class SpacemouseOutput : public Output {
 public:
  /// Throws ConfigError: /dev/uhid is not usable, or vendor 046d, whose SpaceMouse ids the kernel
  /// gives to hid-logitech, which takes real USB devices only.
  explicit SpacemouseOutput(const SpacemouseOptions& options, UniqueFd uhid = UhidDevice::open());
  ~SpacemouseOutput() override;

  SendStatus move(const Sample& sample) noexcept override;
  std::string failure() const override { return device_.failure(); }
  int poll_fd() const noexcept override { return device_.fd(); }
  std::string_view service() noexcept override;

  /// What the client last asked of the LED.
  bool led() const noexcept { return led_; }

  /// What to add to /etc/spnavrc for an own id; empty where spacenavd finds the device by itself.
  std::string spacenavd_advice() const;

  void add_to(std::vector<WatchdogDevice>& devices) const;

 private:
  UhidDevice device_;
  std::uint16_t vendor_;
  std::uint16_t product_;
  Counts6 last_{};
  SpacemouseButtonReport last_buttons_ = spacemouse_button_report(0);
  bool led_ = false;
};

// A virtual HID sensor that carries calibrated force and torque: any HID parser recovers N and N m
// from the report descriptor, see hid_report.h for the layout.

/// 1209 is pid.codes, for open hardware; a placeholder until the product id is registered there.
struct WrenchHidOptions : UhidIdentity {
  WrenchHidOptions() : UhidIdentity{"tagwrench wrench sensor", "tagwrench-0", 0x1209, 0x7a6e} {}
};

/// One report a sample, always of full size, statuses without numbers included.
class WrenchHidOutput : public Output {
 public:
  /// Throws ConfigError if /dev/uhid is not usable.
  explicit WrenchHidOutput(const WrenchHidOptions& options, UniqueFd uhid = UhidDevice::open());
  ~WrenchHidOutput() override { device_.send(neutral_wrench_report()); }

  SendStatus send(const Sample& sample) noexcept override {
    return device_.send(wrench_report(sample));
  }
  std::string failure() const override { return device_.failure(); }
  int poll_fd() const noexcept override { return device_.fd(); }
  std::string_view service() noexcept override {
    // No output report is declared: what comes is answered and dropped.
    while (device_.next_output()) {
    }
    return {};
  }

  void add_to(std::vector<WatchdogDevice>& devices) const {
    devices.push_back(device_.watchdog_device({neutral_wrench_report()}));
  }

 private:
  UhidDevice device_;
};

// A six-axis joystick for games (SDL, Gamepad API) through /dev/uinput (Linux
// Documentation/input/uinput.rst).

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

/// What uinput is told of the joystick. Throws ConfigError: the name does not fit.
uinput_setup joystick_setup(const JoystickOptions& options);

/// Makes the joystick of a node of uinput; false: refused by the kernel, see errno.
bool make_joystick(int uinput, const uinput_setup& setup) noexcept;

/// Sends Sample::deflection as +-32767, and the buttons. No dither: games read states, not events.
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
