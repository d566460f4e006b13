// A virtual SpaceMouse: spacenavd, hidapi programs and browsers take it for a 3Dconnexion
// SpaceMouse Wireless.
#pragma once

#include <string>
#include <vector>

#include "host/output/hid_report.h"
#include "host/output/output.h"
#include "host/output/uhid_device.h"

namespace tagwrench {

struct SpacemouseOptions {
  /// 256f is 3Dconnexion's vendor id, which clients look for. With an own id the axes go out in
  /// spnav's order, because spacenavd passes them straight through; see spacenavd_advice().
  std::uint16_t vendor = 0x256f;
  std::uint16_t product = 0xc62e;  ///< SpaceMouse Wireless: one combined report, two buttons
  std::string name = "tagwrench SpaceMouse";
  std::string serial = "tagwrench-0";
};

/// Sends Sample::deflection as +-350 counts, and buttons when they change. Zero at rest is exact
/// and sent with every move, so that a slow hidraw reader that lost reports still learns of the
/// release. Off-centre every move makes an event (see dithered()). A status that carries no numbers
/// is zeros at once.
class SpacemouseOutput : public Output {
 public:
  /// Throws ConfigError: /dev/uhid is not usable, or vendor 046d, whose SpaceMouse ids the kernel
  /// gives to hid-logitech, which takes real USB devices only.
  explicit SpacemouseOutput(const SpacemouseOptions& options);
  SpacemouseOutput(const SpacemouseOptions& options, UniqueFd uhid);
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
  SpacemouseOutput(UhidDevice device, const SpacemouseOptions& options);

  UhidDevice device_;
  std::uint16_t vendor_;
  std::uint16_t product_;
  Counts6 last_{};
  SpacemouseButtonReport last_buttons_ = spacemouse_button_report(0);
  bool led_ = false;
};

// A virtual HID sensor that carries calibrated force and torque: any HID parser recovers N and N m
// from the report descriptor, see hid_report.h for the layout.

struct WrenchHidOptions {
  /// pid.codes, the vendor id for open hardware. A placeholder until this product id is registered
  /// there.
  std::uint16_t vendor = 0x1209;
  std::uint16_t product = 0x7a6e;
  std::string name = "tagwrench wrench sensor";
  std::string serial = "tagwrench-0";
};

/// One report a sample, always of full size, statuses without numbers included.
class WrenchHidOutput : public Output {
 public:
  /// Throws ConfigError if /dev/uhid is not usable.
  explicit WrenchHidOutput(const WrenchHidOptions& options);
  WrenchHidOutput(const WrenchHidOptions& options, UniqueFd uhid);
  ~WrenchHidOutput() override;

  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return device_.failure(); }
  int poll_fd() const noexcept override { return device_.fd(); }
  std::string_view service() noexcept override;

  void add_to(std::vector<WatchdogDevice>& devices) const;

 private:
  UhidDevice device_;
};

}  // namespace tagwrench
