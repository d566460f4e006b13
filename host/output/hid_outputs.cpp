#include "host/output/hid_outputs.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/device_service.h"

namespace tagwrench {
namespace {

/// The kernel takes an event that is cut short after its payload, and reads the rest as zeros.
struct ShortInput {
  std::uint32_t type = UHID_INPUT2;
  std::uint16_t size = 0;
  std::uint8_t data[64] = {};
} __attribute__((packed));
static_assert(offsetof(ShortInput, data) ==
              offsetof(uhid_event, u) + offsetof(uhid_input2_req, data));

constexpr std::size_t kInputHeader = offsetof(ShortInput, data);

bool printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

template <std::size_t Size>
void copy_text(const std::string& text, std::uint8_t (&field)[Size], const char* what) {
  if (text.size() >= Size || !printable(text)) {
    throw ConfigError("HID {}: must be printable and shorter than {} bytes; shorten it", what,
                      Size);
  }
  std::memcpy(field, text.data(), text.size());
}

/// The driver's lock is interruptible, and what is written may be the return to rest.
ssize_t write_event(const UniqueFd& uhid, const void* event, std::size_t size) {
  return uninterrupted([&] { return ::write(uhid.get(), event, size); });
}

std::string no_longer_taken(const std::string& device, int error) {
  if (error == EPIPE) return device + ": the service of devices has ended; start again";
  return fmt::format("{}: the kernel no longer takes reports: {}; start again", device,
                     std::strerror(error));
}

constexpr std::uint16_t k3dconnexion = 0x256f;
constexpr std::uint16_t kLogitech = 0x046d;

const UhidIdentity& checked(const UhidIdentity& identity) {
  if (identity.vendor != kLogitech) return identity;
  throw ConfigError("spacemouse id " + hex_id(identity.vendor, identity.product) +
                    ": the kernel's hid-logitech driver refuses virtual devices of this vendor; "
                    "use 256f:c62e or an id of your own");
}

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

}  // namespace

void check_sensor_name(std::string_view name) {
  const bool usable = !name.empty() && name.size() <= 32 &&
                      std::all_of(name.begin(), name.end(), [](unsigned char c) {
                        return std::isalnum(c) != 0 || c == '-' || c == '_';
                      });
  if (usable) return;
  throw ConfigError("--name {}: must be 1 to 32 letters, digits, - and _; choose another", name);
}

std::string hex_id(std::uint16_t vendor, std::uint16_t product) {
  return fmt::format("{:04x}:{:04x}", vendor, product);
}

std::unique_ptr<uhid_event> uhid_creation(const UhidIdentity& identity,
                                          std::span<const std::uint8_t> descriptor) {
  auto event = std::make_unique<uhid_event>();
  event->type = UHID_CREATE2;
  uhid_create2_req& request = event->u.create2;
  if (identity.name.empty()) throw ConfigError("HID name: empty; give the device a name");
  copy_text(identity.name, request.name, "name");
  copy_text("tagwrench", request.phys, "location");
  copy_text(identity.serial, request.uniq, "serial");
  if (descriptor.size() > sizeof request.rd_data)
    throw ConfigError(identity.name + ": report descriptor too long; shorten it");
  std::memcpy(request.rd_data, descriptor.data(), descriptor.size());
  request.rd_size = static_cast<std::uint16_t>(descriptor.size());
  // hidapi before 0.16 does not list BUS_VIRTUAL.
  request.bus = BUS_USB;
  request.vendor = identity.vendor;
  request.product = identity.product;
  request.version = 0x0100;
  return event;
}

std::vector<std::uint8_t> uhid_input(std::span<const std::uint8_t> report) {
  ShortInput input;
  const std::size_t size = std::min(report.size(), sizeof input.data);
  input.size = static_cast<std::uint16_t>(size);
  std::memcpy(input.data, report.data(), size);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&input);
  return {bytes, bytes + kInputHeader + size};
}

UniqueFd UhidDevice::open() { return open_device_node(kUhidNode).fd; }

UhidDevice::UhidDevice(UniqueFd uhid, const UhidIdentity& identity,
                       std::span<const std::uint8_t> descriptor,
                       std::chrono::milliseconds start_timeout)
    : uhid_(std::move(uhid)),
      label_(fmt::format("{}: {} ({})", kUhidNode.path(), identity.name,
                         hex_id(identity.vendor, identity.product))),
      event_(uhid_creation(identity, descriptor)) {
  if (write_event(uhid_, event_.get(), sizeof(uhid_event)) < 0) {
    throw ConfigError("{}: the kernel refused the device: {}; see dmesg", label_,
                      std::strerror(errno));
  }
  wait_for_start(identity, start_timeout);
}

UhidDevice::~UhidDevice() {
  if (!uhid_) return;
  const std::uint32_t destroy = UHID_DESTROY;
  [[maybe_unused]] const ssize_t written = write_event(uhid_, &destroy, sizeof destroy);
}

void UhidDevice::wait_for_start(const UhidIdentity& identity, std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const auto give_up = Clock::now() + timeout;
  while (!service_gone_) {
    while (read_event()) {
      if (event_->type == UHID_START) return;
      if (event_->type == UHID_GET_REPORT) answer_get_report();
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(give_up - Clock::now());
    if (left.count() <= 0) break;
    pollfd waiting{uhid_.get(), POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(left.count())) < 0 && errno != EINTR) break;
    if ((waiting.revents & POLLIN) == 0 && (waiting.revents & (POLLHUP | POLLERR)) != 0) break;
  }
  if (service_gone_) {
    throw ConfigError(
        "{}: the service of devices does not make one of this id; use 256f:c62e or one of vendor "
        "1209, or open /dev/uhid to yourself (71-tagwrench-direct.rules)",
        label_);
  }
  throw ConfigError(
      "{}: the kernel did not start a device with id {}; load its driver: sudo modprobe "
      "hid-generic",
      label_, hex_id(identity.vendor, identity.product));
}

SendStatus UhidDevice::send(std::span<const std::uint8_t> report) noexcept {
  ShortInput input;
  if (report.size() > sizeof input.data) return SendStatus::failed;
  input.size = static_cast<std::uint16_t>(report.size());
  std::memcpy(input.data, report.data(), report.size());
  if (write_event(uhid_, &input, kInputHeader + report.size()) < 0) {
    if (errno == EAGAIN) return SendStatus::skipped;
    error_ = errno;
    return SendStatus::failed;
  }
  std::memcpy(last_input_.bytes.data(), report.data(), report.size());
  last_input_.size = report.size();
  return SendStatus::ok;
}

std::string UhidDevice::failure() const { return no_longer_taken(label_, error_); }

bool UhidDevice::read_event() noexcept {
  const ssize_t got = ::read(uhid_.get(), event_.get(), sizeof(uhid_event));
  if (got == 0) service_gone_ = true;
  if (got < static_cast<ssize_t>(sizeof event_->type)) return false;
  // A short event leaves no bytes of the one before it.
  std::memset(reinterpret_cast<char*>(event_.get()) + got, 0,
              sizeof(uhid_event) - static_cast<std::size_t>(got));
  return true;
}

void UhidDevice::answer_get_report() noexcept {
  const std::uint32_t id = event_->u.get_report.id;
  const bool known = event_->u.get_report.rtype == UHID_INPUT_REPORT && last_input_.size > 0 &&
                     last_input_.bytes[0] == event_->u.get_report.rnum;
  *event_ = {};
  event_->type = UHID_GET_REPORT_REPLY;
  uhid_get_report_reply_req& reply = event_->u.get_report_reply;
  reply.id = id;
  reply.err = known ? 0 : EIO;
  if (known) {
    reply.size = static_cast<std::uint16_t>(last_input_.size);
    std::memcpy(reply.data, last_input_.bytes.data(), last_input_.size);
  }
  [[maybe_unused]] const ssize_t written = write_event(uhid_, event_.get(), sizeof(uhid_event));
}

std::optional<HidOutputReport> UhidDevice::next_output() noexcept {
  const auto take = [](const std::uint8_t* data, std::size_t size) {
    HidOutputReport report;
    report.size = std::min(size, report.bytes.size());
    std::memcpy(report.bytes.data(), data, report.size);
    return report;
  };
  while (read_event()) {
    if (event_->type == UHID_OUTPUT) {
      const uhid_output_req& output = event_->u.output;
      if (output.rtype == UHID_OUTPUT_REPORT) return take(output.data, output.size);
    } else if (event_->type == UHID_GET_REPORT) {
      answer_get_report();
    } else if (event_->type == UHID_SET_REPORT) {
      const std::uint32_t id = event_->u.set_report.id;
      const bool output = event_->u.set_report.rtype == UHID_OUTPUT_REPORT;
      const HidOutputReport report = take(event_->u.set_report.data, event_->u.set_report.size);
      *event_ = {};
      event_->type = UHID_SET_REPORT_REPLY;
      event_->u.set_report_reply.id = id;
      event_->u.set_report_reply.err = output ? 0 : EIO;
      [[maybe_unused]] const ssize_t n = write_event(uhid_, event_.get(), sizeof(uhid_event));
      if (output) return report;
    }
  }
  return std::nullopt;
}

WatchdogDevice UhidDevice::watchdog_device(
    std::initializer_list<std::span<const std::uint8_t>> neutral) const {
  WatchdogDevice device;
  device.fd = uhid_.get();
  for (const std::span<const std::uint8_t> report : neutral)
    device.neutral.push_back(uhid_input(report));
  const std::uint32_t destroy = UHID_DESTROY;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&destroy);
  device.destroy.assign(bytes, bytes + sizeof destroy);
  return device;
}

SpacemouseOutput::SpacemouseOutput(const SpacemouseOptions& options, UniqueFd uhid)
    : device_(std::move(uhid), checked(options), spacemouse_descriptor()),
      vendor_(options.vendor),
      product_(options.product) {
  device_.send(spacemouse_report({}));
}

SpacemouseOutput::~SpacemouseOutput() {
  device_.send(spacemouse_report({}));
  const SpacemouseButtonReport released = spacemouse_button_report(0);
  if (last_buttons_ != released) device_.send(released);
}

SendStatus SpacemouseOutput::move(const Sample& sample) noexcept {
  auto [wanted, pressed] = shown_motion(sample, kSpacemouseLimit_counts);
  if (vendor_ != k3dconnexion) wanted = to_spnav_order(wanted);
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
  while (const auto report = device_.next_output())
    if (report->size >= 2 && report->bytes[0] == kSpacemouseLedReportId)
      led_ = (report->bytes[1] & 1) != 0;
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

WrenchHidOutput::WrenchHidOutput(const WrenchHidOptions& options, UniqueFd uhid)
    : device_(std::move(uhid), options, wrench_descriptor()) {}

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

uinput_setup joystick_setup(const JoystickOptions& options) {
  uinput_setup setup{};
  if (options.name.empty() || options.name.size() >= sizeof setup.name || !printable(options.name))
    throw ConfigError("joystick name: must be 1 to 79 printable bytes; change it");
  std::memcpy(setup.name, options.name.data(), options.name.size());
  // Games that look for a bus, vendor and product skip devices without them.
  setup.id = {BUS_USB, options.vendor, options.product, 0x0100};
  return setup;
}

bool make_joystick(int uinput, const uinput_setup& setup) noexcept {
  bool good = order(uinput, UI_SET_EVBIT, EV_KEY) && order(uinput, UI_SET_EVBIT, EV_ABS);
  for (const int button : kButtons) good = good && order(uinput, UI_SET_KEYBIT, button);
  for (const std::uint16_t axis : kAxes) {
    uinput_abs_setup abs{};
    abs.code = axis;
    abs.absinfo.minimum = -kJoystickLimit_counts;
    abs.absinfo.maximum = kJoystickLimit_counts;
    good = good && order(uinput, UI_ABS_SETUP, &abs);
  }
  return good && order(uinput, UI_DEV_SETUP, &setup) && order(uinput, UI_DEV_CREATE);
}

JoystickOutput::JoystickOutput(const JoystickOptions& options) {
  const uinput_setup setup = joystick_setup(options);
  OpenedNode node = open_device_node(kUinputNode);
  uinput_ = std::move(node.fd);
  const int fd = uinput_.get();
  if (node.lent) {
    errno = ::send(fd, &setup, sizeof setup, MSG_NOSIGNAL) < 0 ? errno : device_answer(fd);
  } else {
    errno = make_joystick(fd, setup) ? 0 : errno;
  }
  if (errno != 0) {
    throw ConfigError(
        "{}: {} is refused: {}; {}", kUinputNode.path(), options.name, std::strerror(errno),
        node.lent ? "see: systemctl status 'tagwrench-devices*'" : "it needs Linux 4.5 or later");
  }
}

JoystickOutput::~JoystickOutput() {
  JoystickOutput::move(Sample{});
  // The watchdog's duplicate of the fd would keep it alive. The node knows one, a connection to the
  // service the other.
  order(uinput_.get(), UI_DEV_DESTROY);
  ::shutdown(uinput_.get(), SHUT_RDWR);
}

SendStatus JoystickOutput::move(const Sample& sample) noexcept {
  const auto [counts, pressed] = shown_motion(sample, kJoystickLimit_counts);
  const JoystickEvents events = joystick_events(counts, pressed);
  const auto write = [&] { return ::write(uinput_.get(), events.data(), sizeof events); };
  if (uninterrupted(write) >= 0) return SendStatus::ok;
  if (errno == EAGAIN) return SendStatus::skipped;
  error_ = errno;
  return SendStatus::failed;
}

std::string JoystickOutput::failure() const { return no_longer_taken(kUinputNode.path(), error_); }

void JoystickOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  const JoystickEvents neutral = joystick_events({}, 0);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(neutral.data());
  devices.push_back({uinput_.get(), {{bytes, bytes + sizeof neutral}}, {}});
}

}  // namespace tagwrench
