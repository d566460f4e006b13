#include "host/output/wrench_hid.h"

#include <utility>

namespace tagwrench {
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
