#include "host/output/gadget_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/spawn_daemon.h"
#include "host/core/os/termination.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/hid_report.h"
#include "host/output/output.h"

namespace tagwrench {
namespace {

constexpr std::uint16_t k3dconnexion = 0x256f;
constexpr int kStart_ms = 10'000;  // of a daemon on a busy machine
constexpr int kPatience_ms = 300;  // with a computer that takes rest in its own time

using Packet =
    std::array<std::uint8_t, SpacemouseReport().size() + SpacemouseButtonReport().size()>;

Packet packet(const Counts6& counts, std::uint32_t pressed) noexcept {
  Packet bytes;
  const SpacemouseReport motion = spacemouse_report(counts);
  const SpacemouseButtonReport buttons = spacemouse_button_report(pressed);
  std::copy(motion.begin(), motion.end(), bytes.begin());
  std::copy(buttons.begin(), buttons.end(), bytes.begin() + motion.size());
  return bytes;
}

std::vector<std::uint8_t> neutral(GadgetFace face) {
  if (face == GadgetFace::spacemouse) {
    const Packet rest = packet({}, 0);
    return {rest.begin(), rest.end()};
  }
  const WrenchReport rest = neutral_wrench_report();
  return {rest.begin(), rest.end()};
}

std::string_view news_text(GadgetEvent status_line) noexcept {
  switch (status_line) {
    case GadgetEvent::taken:
      return "gadget: the other computer takes reports";
    case GadgetEvent::nobody:
      return "gadget: no computer at the other end; goes on when there is one";
    case GadgetEvent::asleep:
      return "gadget: the other computer does not ask for reports (asleep?); goes on when it does";
    case GadgetEvent::gone:
      return "gadget: it was taken down; goes on after `tagwrench gadget up`";
    case GadgetEvent::led_off:
      return "gadget: LED off";
    case GadgetEvent::led_on:
      return "gadget: LED on";
    case GadgetEvent::none:
    case GadgetEvent::ready:
      break;
  }
  return {};
}

std::string up_command(const GadgetOptions& options) {
  std::string command = "sudo tagwrench gadget up";
  if (options.face.value_or(GadgetFace::spacemouse) != GadgetFace::spacemouse)
    command += fmt::format(" --face {}", face_name(*options.face));
  if (options.name != GadgetOptions().name) command += " --name " + options.name;
  return command;
}

[[noreturn]] void no_daemon(const char* what, const char* why) {
  throw ConfigError(fmt::format("gadget: {}: {}; end other programs", what, why));
}

[[noreturn]] void cannot_open(const GadgetOptions& options, const OpenedNode& node) {
  const std::string which = std::string(kGadgetPrefix) + options.name;
  if (node.error == EWOULDBLOCK) {
    throw ConfigError(fmt::format(
        "gadget {}: another bridge writes to {}; stop it, or give this one a gadget of its own",
        which, node.path));
  }
  if (node.error == EACCES || node.error == EPERM) {
    throw ConfigError(
        fmt::format("gadget {}: {}: permission denied; install 70-tagwrench.rules in "
                    "/etc/udev/rules.d and join the group input, or run as root",
                    which, node.path));
  }
  throw ConfigError(fmt::format("gadget {}: {}: {}; make it anew: {}", which,
                                node.path.empty() ? "no device node" : node.path,
                                std::strerror(node.error == 0 ? ENOENT : node.error),
                                up_command(options)));
}

}  // namespace

GadgetPort find_gadget(const GadgetOptions& options) {
  GadgetFiles files;
  const GadgetTree tree(files, options.places.gadgets());
  const std::optional<GadgetFound> found = tree.find(options.name);
  const std::string which = std::string(kGadgetPrefix) + options.name;
  if (!found || !found->whole || !found->face) {
    throw ConfigError(
        fmt::format("gadget {}: it is not up; make it: {}", which, up_command(options)));
  }
  if (options.face && options.face != found->face) {
    throw ConfigError(fmt::format("gadget {}: it is up with the face {}; use that one, or: {}",
                                  which, face_name(*found->face), up_command(options)));
  }
  GadgetPort port;
  port.face = *found->face;
  port.spnav_order = found->id.vendor != k3dconnexion;
  port.places = options.places;
  port.function = tree.function(options.name, port.face);
  port.node = open_gadget_node(files, port.places, port.function);
  if (!port.node.fd) cannot_open(options, port.node);
  return port;
}

void keep_gadget(const GadgetInheritance& given) {
  ::prctl(PR_SET_NAME, "tw-gadget");  // so that a kill by the bridge's name spares it
  ignore_signals();                   // Ctrl-C is for the bridge: the daemon ends with its link
  UniqueFd link(kFirstDaemonFd), watch(kFirstDaemonFd + 1);
  OpenedNode node;
  node.fd.reset(kFirstDaemonFd + 2);
  node.path = given.node;
  for (const UniqueFd* fd : {&link, &watch, &node.fd}) {
    // A bridge's they are not if the verb is typed.
    if (::fcntl(fd->get(), F_SETFD, FD_CLOEXEC) != 0)
      throw ConfigError("gadget keep: is for `tagwrench run --output gadget`, which starts it");
  }
  GadgetDaemon(given.face, std::move(link), std::move(watch), std::move(node), [given] {
    return open_gadget_node(GadgetFiles(), given.places, given.function);
  }).run();
}

GadgetOutput::GadgetOutput(GadgetPort port)
    : face_(port.face),
      spnav_order_(port.spnav_order),
      places_(port.places),
      function_(port.function) {
  start_daemon(port);
  port.node.fd.reset();  // the daemon's alone
  await_daemon();
}

/// By exec and not by fork alone: it allocates, and a thread of a library may hold malloc's lock.
void GadgetOutput::start_daemon(const GadgetPort& port) {
  const UniqueFd watch = watch_nodes(port.places.devices);
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0)
    no_daemon("cannot make a socket", std::strerror(errno));
  link_.reset(ends[0]);
  const UniqueFd daemon_end(ends[1]);
  const int inherited[] = {daemon_end.get(), watch.get(), port.node.fd.get()};
  const int error =
      spawn_daemon(daemon_, port.program,
                   {"tagwrench", "gadget", "keep", "--face", std::string(face_name(face_)),
                    "--sysfs", port.places.sysfs, "--devices", port.places.devices, "--function",
                    port.function, "--node", port.node.path},
                   inherited, DaemonSignals::blocked);
  if (error != 0) no_daemon("cannot start its process", std::strerror(error));
}

void GadgetOutput::await_daemon() {
  pollfd first{link_.get(), POLLIN, 0};
  uninterrupted([&] { return ::poll(&first, 1, kStart_ms); });
  GadgetEvent status_line{};
  const ssize_t got = ::recv(link_.get(), &status_line, sizeof status_line, MSG_DONTWAIT);
  if (got == sizeof status_line && status_line == GadgetEvent::ready) return;
  const char* why = got < 0 ? "it says nothing" : "it has ended";
  link_.reset();
  ::kill(daemon_, SIGKILL);
  uninterrupted([this] { return ::waitpid(daemon_, nullptr, 0); });
  no_daemon("its process does not begin", why);
}

GadgetOutput::~GadgetOutput() {
  if (daemon_ <= 0) return;
  const bool there = !lost_;
  ::shutdown(link_.get(), SHUT_WR);  // the watchdog's duplicate cannot keep it open
  pollfd gone{link_.get(), 0, 0};
  const auto wait = [&] { return ::poll(&gone, 1, kPatience_ms); };
  if (uninterrupted(wait) > 0) uninterrupted([this] { return ::waitpid(daemon_, nullptr, 0); });
  if (there) return;
  const OpenedNode node = open_gadget_node(GadgetFiles(), places_, function_);
  if (node.fd) rest_gadget(node.fd.get(), face_);
}

SendStatus GadgetOutput::put(std::span<const std::uint8_t> reports) noexcept {
  if (lost_) return SendStatus::failed;
  if (::send(link_.get(), reports.data(), reports.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0)
    return SendStatus::ok;
  if (errno == EAGAIN || errno == EINTR) return SendStatus::skipped;
  lost_ = true;
  return SendStatus::failed;
}

SendStatus GadgetOutput::send(const Sample& sample) noexcept {
  return face_ == GadgetFace::wrench ? put(wrench_report(sample)) : SendStatus::ok;
}

SendStatus GadgetOutput::move(const Sample& sample) noexcept {
  if (face_ != GadgetFace::spacemouse) return SendStatus::ok;
  Counts6 counts{};
  std::uint32_t pressed = 0;
  if (carries_numbers(shown_status(sample))) {
    pressed = sample.buttons;
    counts = to_counts(sample.deflection, kSpacemouseLimit_counts);
    if (spnav_order_) counts = to_spnav_order(counts);
  }
  return put(packet(counts, pressed));
}

std::string GadgetOutput::failure() const {
  return "gadget: the process that writes to it (tw-gadget) has ended; start again";
}

std::string_view GadgetOutput::service() noexcept {
  std::array<std::uint8_t, 16> message;
  const ssize_t got = ::recv(link_.get(), message.data(), message.size(), MSG_DONTWAIT);
  lost_ = lost_ || got == 0;
  return got > 0 ? news_text(static_cast<GadgetEvent>(message[0])) : std::string_view();
}

void GadgetOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  devices.push_back({link_.get(), {neutral(face_)}, {}});
}

}  // namespace tagwrench
