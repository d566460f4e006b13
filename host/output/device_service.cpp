#include "host/output/device_service.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/hid_outputs.h"

namespace tagwrench {
namespace {

constexpr int kPatience_ms = 5000;       // systemd starts the service at the first connection
constexpr int kSendBuffer_bytes = 8192;  // room for the longest event; of reports a dozen or two

/// -1: nobody serves there, see errno.
UniqueFd connect_service(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  UniqueFd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd || path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.c_str(), path.size());
  // What a stopped service does not read is not to come late: the latest report counts.
  ::setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer_bytes, sizeof kSendBuffer_bytes);
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  if (::connect(fd.get(), generic, sizeof address) != 0) fd.reset();
  return fd;
}

/// The text of a field of fixed size, if it ends in it.
template <std::size_t Size, typename Char>
std::string text_of(const Char (&field)[Size]) {
  const auto* text = reinterpret_cast<const char*>(field);
  return {text, ::strnlen(text, Size)};
}

/// The bytes as the structure that they are said to be; shorter ones go on with zeros.
template <typename Event>
std::unique_ptr<Event> as(std::span<const std::uint8_t> bytes) {
  auto event = std::make_unique<Event>();
  std::memcpy(event.get(), bytes.data(), std::min(bytes.size(), sizeof *event));
  return event;
}

/// Whether it is `before` and the name of a sensor. Throws ConfigError: another name.
bool names_sensor(std::string_view text, std::string_view before) {
  if (!text.starts_with(before)) return false;
  check_sensor_name(text.substr(before.size()));
  return true;
}

}  // namespace

OpenedNode open_device_node(const DeviceNode& node, const std::string& folder) {
  const std::string path = node.path();
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
  if (fd) return {std::move(fd), false};
  const int error = errno;
  if (error != EACCES && error != EPERM) throw ConfigError(cannot_open_node(node, error));
  fd = connect_service(folder + "/" + node.name);
  if (!fd) throw ConfigError(cannot_open_node(node, error));
  switch (const DeviceAnswer answer = device_answer(fd.get())) {
    case 0: return {std::move(fd), true};
    case EACCES:
      throw ConfigError(
          "{}: the service of devices serves who sits at this computer, and the group {}: sudo "
          "usermod -aG {} $USER, then log in again",
          path, kDeviceGroup, kDeviceGroup);
    case ETIMEDOUT:
    case EPIPE:
      throw ConfigError(
          "{}: the service of devices does not answer: {}; see: systemctl status "
          "'tagwrench-devices*'",
          path, std::strerror(answer));
    default: throw ConfigError(cannot_open_node(node, answer));
  }
}

std::string cannot_open_node(const DeviceNode& node, int error) {
  const std::string path = node.path();
  switch (error) {
    case EACCES:
    case EPERM:
      return fmt::format(
          "{}: permission denied, and no service makes devices; install the package, or, where it "
          "is, sudo systemctl start tagwrench-devices.socket; or run as root",
          path);
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return fmt::format("{}: not there; load the kernel module: sudo modprobe {}", path,
                         node.name);
    default:
      return fmt::format("{}: {}; check it with: ls -l {}", path, std::strerror(error), path);
  }
}

DeviceAnswer device_answer(int connection) {
  pollfd waiting{connection, POLLIN, 0};
  if (uninterrupted([&] { return ::poll(&waiting, 1, kPatience_ms); }) <= 0) return ETIMEDOUT;
  DeviceAnswer answer = 0;
  const ssize_t got = ::recv(connection, &answer, sizeof answer, 0);
  return got == sizeof answer ? answer : EPIPE;
}

bool UhidGate::passes(std::span<const std::uint8_t> event) noexcept {
  constexpr std::size_t kData = offsetof(uhid_event, u) + offsetof(uhid_input2_req, data);
  std::uint32_t type = 0;
  if (ended_ || event.size() < sizeof type || event.size() > sizeof(uhid_event)) return false;
  std::memcpy(&type, event.data(), sizeof type);
  if (!created_) {
    if (type != UHID_CREATE2 || event.size() != sizeof(uhid_event)) return false;
    created_ = is_ours(as<uhid_event>(event)->u.create2);
    return created_;
  }
  switch (type) {
    case UHID_INPUT2:
      return event.size() >= kData && event.size() <= kData + HidOutputReport{}.bytes.size() &&
             as<uhid_event>(event)->u.input2.size == event.size() - kData;
    case UHID_GET_REPORT_REPLY:
    case UHID_SET_REPORT_REPLY: return event.size() == sizeof(uhid_event);
    case UHID_DESTROY: ended_ = true; return event.size() == sizeof type;
    default: return false;
  }
}

/// What UhidDevice would write for this name, serial number and id, byte by byte.
bool UhidGate::is_ours(const uhid_create2_req& asked) try {
  const UhidIdentity identity{text_of(asked.name), text_of(asked.uniq),
                              static_cast<std::uint16_t>(asked.vendor),
                              static_cast<std::uint16_t>(asked.product)};
  if (!lent_id(asked.vendor, asked.product) || !names_sensor(identity.serial, "tagwrench-"))
    return false;
  const auto is = [&](std::span<const std::uint8_t> descriptor) {
    const auto ours = uhid_creation(identity, descriptor);
    return std::memcmp(&ours->u.create2, &asked, sizeof asked) == 0;
  };
  if (identity.name == SpacemouseOptions().name && is(spacemouse_descriptor())) {
    neutral_ = {uhid_input(spacemouse_report({})), uhid_input(spacemouse_button_report(0))};
  } else if (identity.name == WrenchHidOptions().name && is(wrench_descriptor())) {
    neutral_ = {uhid_input(neutral_wrench_report())};
  }
  return !neutral_.empty();
} catch (const ConfigError&) {
  return false;
}

std::optional<uinput_setup> lent_joystick(std::span<const std::uint8_t> bytes) noexcept try {
  if (bytes.size() != sizeof(uinput_setup)) return std::nullopt;
  const auto asked = as<uinput_setup>(bytes);
  JoystickOptions options;
  const std::string usual = std::exchange(options.name, text_of(asked->name));
  const uinput_setup ours = joystick_setup(options);
  const bool named = options.name == usual || names_sensor(options.name, usual + " ");
  if (!named || std::memcmp(&ours, asked.get(), sizeof ours) != 0) return std::nullopt;
  return ours;
} catch (const ConfigError&) {
  return std::nullopt;
}

bool is_joystick_frame(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != sizeof(JoystickEvents)) return false;
  const auto events = as<JoystickEvents>(bytes);
  Counts6 counts{};
  std::uint32_t pressed = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = static_cast<std::int16_t>(
        std::clamp((*events)[i].value, -kJoystickLimit_counts, kJoystickLimit_counts));
  for (std::size_t i = 0; i < kJoystickButtons; ++i)
    if ((*events)[counts.size() + i].value != 0) pressed |= 1U << i;
  const JoystickEvents ours = joystick_events(counts, pressed);
  return std::memcmp(&ours, events.get(), sizeof ours) == 0;
}

}  // namespace tagwrench
