#include "host/output/uhid_outputs.h"

#include <utility>

#include "host/core/config_error.h"
#include "host/output/output.h"

namespace tagwrench {
namespace {

constexpr std::uint16_t k3dconnexion = 0x256f;
constexpr std::uint16_t kLogitech = 0x046d;

UhidIdentity identity(const SpacemouseOptions& options) {
  if (options.vendor == kLogitech) {
    throw ConfigError(
        "spacemouse id " + hex_id(options.vendor, options.product) +
        ": the kernel's hid-logitech driver refuses virtual devices of this vendor; use "
        "256f:c62e or an id of your own");
  }
  return {options.name, options.serial, options.vendor, options.product};
}

}  // namespace

SpacemouseOutput::SpacemouseOutput(const SpacemouseOptions& options)
    : SpacemouseOutput(UhidDevice(identity(options), spacemouse_descriptor()), options) {}

SpacemouseOutput::SpacemouseOutput(const SpacemouseOptions& options, UniqueFd uhid)
    : SpacemouseOutput(UhidDevice(std::move(uhid), identity(options), spacemouse_descriptor()),
                       options) {}

SpacemouseOutput::SpacemouseOutput(UhidDevice device, const SpacemouseOptions& options)
    : device_(std::move(device)), vendor_(options.vendor), product_(options.product) {
  device_.send(spacemouse_report({}));
}

SpacemouseOutput::~SpacemouseOutput() {
  device_.send(spacemouse_report({}));
  const SpacemouseButtonReport released = spacemouse_button_report(0);
  if (last_buttons_ != released) device_.send(released);
}

SendStatus SpacemouseOutput::move(const Sample& sample) noexcept {
  Counts6 wanted{};
  std::uint32_t pressed = 0;
  if (carries_numbers(shown_status(sample))) {
    pressed = sample.buttons;
    wanted = to_counts(sample.deflection, kSpacemouseLimit_counts);
    if (vendor_ != k3dconnexion) wanted = to_spnav_order(wanted);
  }
  const Counts6 counts = dithered(wanted, last_);
  const SendStatus status = device_.send(spacemouse_report(counts));
  if (status == SendStatus::ok) last_ = counts;
  const SpacemouseButtonReport buttons = spacemouse_button_report(pressed);
  if (status != SendStatus::ok || buttons == last_buttons_) return status;
  const SendStatus pressing = device_.send(buttons);
  if (pressing == SendStatus::ok) last_buttons_ = buttons;
  return pressing;
}

std::string_view SpacemouseOutput::service() noexcept {
  const bool before = led_;
  while (const auto report = device_.next_output()) {
    if (report->size >= 2 && report->bytes[0] == kSpacemouseLedReportId) {
      led_ = (report->bytes[1] & 1) != 0;
    }
  }
  if (led_ == before) return {};
  return led_ ? "spacemouse: LED on" : "spacemouse: LED off";
}

std::string SpacemouseOutput::spacenavd_advice() const {
  if (vendor_ == k3dconnexion) return {};
  return "spacenavd: add this line to /etc/spnavrc and restart it: device-id = " +
         hex_id(vendor_, product_);
}

void SpacemouseOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  const SpacemouseReport rest = spacemouse_report({});
  const SpacemouseButtonReport released = spacemouse_button_report(0);
  devices.push_back(device_.watchdog_device({rest, released}));
}

namespace {

UhidIdentity identity(const WrenchHidOptions& options) {
  return {options.name, options.serial, options.vendor, options.product};
}

}  // namespace

WrenchHidOutput::WrenchHidOutput(const WrenchHidOptions& options)
    : device_(identity(options), wrench_descriptor()) {}

WrenchHidOutput::WrenchHidOutput(const WrenchHidOptions& options, UniqueFd uhid)
    : device_(std::move(uhid), identity(options), wrench_descriptor()) {}

WrenchHidOutput::~WrenchHidOutput() { device_.send(neutral_wrench_report()); }

SendStatus WrenchHidOutput::send(const Sample& sample) noexcept {
  return device_.send(wrench_report(sample));
}

std::string_view WrenchHidOutput::service() noexcept {
  // No output report is declared: what comes is answered and dropped.
  while (device_.next_output()) {
  }
  return {};
}

void WrenchHidOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  devices.push_back(device_.watchdog_device({neutral_wrench_report()}));
}

}  // namespace tagwrench
