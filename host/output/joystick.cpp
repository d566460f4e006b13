#include "host/output/joystick.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/uinput.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/output.h"
#include "host/output/uhid_device.h"

namespace tagwrench {
namespace {

constexpr const char* kPath = "/dev/uinput";
constexpr std::uint16_t kAxes[] = {ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ};

// Six absolute axes without any key would be an accelerometer to udev and SDL; these codes mean
// joystick to both.
constexpr std::array<std::uint16_t, kJoystickButtons> kButtons = {
    BTN_TRIGGER, BTN_THUMB, BTN_THUMB2, BTN_TOP, BTN_TOP2, BTN_PINKIE, BTN_BASE, BTN_BASE2};

/// The driver's lock is interruptible.
template <typename... Argument>
bool order(int fd, unsigned long request, Argument... argument) {
  return uninterrupted([&] { return ::ioctl(fd, request, argument...); }) == 0;
}

uinput_setup setup_of(const JoystickOptions& options) {
  uinput_setup setup{};
  const bool printable = std::all_of(options.name.begin(), options.name.end(),
                                     [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
  if (options.name.empty() || options.name.size() >= sizeof setup.name || !printable) {
    throw ConfigError("joystick name: must be 1 to 79 printable bytes; change it");
  }
  std::memcpy(setup.name, options.name.data(), options.name.size());
  // Games that look for a bus, vendor and product skip devices without them.
  setup.id = {BUS_USB, options.vendor, options.product, 0x0100};
  return setup;
}

}  // namespace

JoystickEvents joystick_events(const Counts6& counts, std::uint32_t pressed) noexcept {
  JoystickEvents events{};
  for (std::size_t i = 0; i < 6; ++i) {
    events[i].type = EV_ABS;
    events[i].code = kAxes[i];
    events[i].value = counts[i];
  }
  for (std::size_t i = 0; i < kJoystickButtons; ++i) {
    events[6 + i].type = EV_KEY;
    events[6 + i].code = kButtons[i];
    events[6 + i].value = (pressed >> i) & 1U;
  }
  events.back().type = EV_SYN;
  events.back().code = SYN_REPORT;
  return events;
}

JoystickOutput::JoystickOutput(const JoystickOptions& options) {
  uinput_setup setup = setup_of(options);
  uinput_.reset(::open(kPath, O_WRONLY | O_CLOEXEC | O_NONBLOCK));
  if (!uinput_) throw ConfigError(cannot_open_node(kPath, "uinput", errno));
  const int fd = uinput_.get();
  bool good = order(fd, UI_SET_EVBIT, EV_KEY) && order(fd, UI_SET_EVBIT, EV_ABS);
  for (const int button : kButtons) good = good && order(fd, UI_SET_KEYBIT, button);
  for (const std::uint16_t axis : kAxes) {
    uinput_abs_setup abs{};
    abs.code = axis;
    abs.absinfo.minimum = -kJoystickLimit_counts;
    abs.absinfo.maximum = kJoystickLimit_counts;
    good = good && order(fd, UI_ABS_SETUP, &abs);
  }
  good = good && order(fd, UI_DEV_SETUP, &setup) && order(fd, UI_DEV_CREATE);
  if (!good) {
    throw ConfigError(std::string(kPath) + ": the kernel refused " + options.name + ": " +
                      std::strerror(errno) + "; it needs Linux 4.5 or later");
  }
}

JoystickOutput::~JoystickOutput() {
  JoystickOutput::move(Sample{});
  order(uinput_.get(), UI_DEV_DESTROY);  // the watchdog's duplicate of the fd would keep it alive
}

SendStatus JoystickOutput::move(const Sample& sample) noexcept {
  Counts6 counts{};
  std::uint32_t pressed = 0;
  if (carries_numbers(shown_status(sample))) {
    pressed = sample.buttons;
    counts = to_counts(sample.deflection, kJoystickLimit_counts);
  }
  const JoystickEvents events = joystick_events(counts, pressed);
  const auto write = [&] { return ::write(uinput_.get(), events.data(), sizeof events); };
  if (uninterrupted(write) >= 0) return SendStatus::ok;
  if (errno == EAGAIN) return SendStatus::skipped;
  error_ = errno;
  return SendStatus::failed;
}

std::string JoystickOutput::failure() const {
  return fmt::format("{}: the kernel no longer takes events: {}; start again", kPath,
                     std::strerror(error_));
}

void JoystickOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  const JoystickEvents neutral = joystick_events({}, 0);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(neutral.data());
  devices.push_back({uinput_.get(), {{bytes, bytes + sizeof neutral}}, {}});
}

}  // namespace tagwrench
