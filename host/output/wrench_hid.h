// A virtual HID sensor that carries calibrated force and torque: any HID parser recovers N and N m
// from the report descriptor, see hid_report.h for the layout.
#pragma once

#include <string>
#include <vector>

#include "host/output/hid_report.h"
#include "host/output/output.h"
#include "host/output/uhid_device.h"

namespace tagwrench {

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
