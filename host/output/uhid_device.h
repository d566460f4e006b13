// One virtual HID device through /dev/uhid (Linux Documentation/hid/uhid.rst): evdev node, hidraw
// node and LED back-channel as a real USB device has them.
#pragma once

#include <linux/uhid.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

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

class UhidDevice {
 public:
  static constexpr const char* kPath = "/dev/uhid";
  /// The kernel starts a device in milliseconds once its driver is loaded; the rest is patience
  /// with a slow machine.
  static constexpr std::chrono::milliseconds kStartTimeout{3000};

  /// Opens /dev/uhid, creates the device on BUS_USB and waits until the kernel has started it.
  /// Throws ConfigError: no /dev/uhid, no permission, refused by the kernel, not started in time.
  UhidDevice(const UhidIdentity& identity, std::span<const std::uint8_t> descriptor);

  /// The same on a descriptor that is open already: one that a helper with more rights has opened.
  UhidDevice(UniqueFd uhid, const UhidIdentity& identity, std::span<const std::uint8_t> descriptor,
             std::chrono::milliseconds start_timeout = kStartTimeout);

  UhidDevice(UhidDevice&&) = default;
  UhidDevice& operator=(UhidDevice&&) = delete;
  /// Destroys the device; the watchdog's duplicate of the fd cannot keep it alive.
  ~UhidDevice();

  /// Sends one input report, report id first, at most 64 bytes. Never blocks, never queues.
  SendStatus send(std::span<const std::uint8_t> report) noexcept;

  /// Answers what the kernel asks and returns the next output report that a client has sent, if
  /// there is one.
  std::optional<HidOutputReport> next_output() noexcept;

  /// Readable when next_output() has something to do.
  int fd() const noexcept { return uhid_.get(); }

  /// One line about the last failed send().
  std::string failure() const;

  /// For the watchdog: these input reports, then the device's end.
  WatchdogDevice watchdog_device(
      std::initializer_list<std::span<const std::uint8_t>> neutral) const;

 private:
  void create(const UhidIdentity& identity, std::span<const std::uint8_t> descriptor);
  void wait_for_start(const UhidIdentity& identity, std::chrono::milliseconds timeout);
  bool read_event() noexcept;
  void answer_get_report() noexcept;

  UniqueFd uhid_;
  std::string label_;  ///< of messages: "/dev/uhid: tagwrench SpaceMouse (256f:c62e)"
  std::unique_ptr<uhid_event> event_;  ///< 4380 bytes, read again and again
  HidOutputReport last_input_;         ///< what GET_REPORT is answered with
  int error_ = 0;
};

/// "256f:c62e"
std::string hex_id(std::uint16_t vendor, std::uint16_t product);

/// What to say when the node at `path` (/dev/uhid, /dev/uinput) does not open: path, cause, remedy,
/// in one line.
std::string cannot_open_node(const std::string& path, const char* module, int error);

}  // namespace tagwrench
