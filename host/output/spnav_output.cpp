#include "host/output/spnav_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <span>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/child_process.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kMaxPrograms = 128;
constexpr int kAttempts = 3;
constexpr milliseconds kStartTime{10'000};  // of a daemon on a busy machine
constexpr milliseconds kLookEvery{500};     // whether it is stopped
constexpr Duration kBetweenAttempts = std::chrono::seconds(1);
// A move that is so late is missing: with the 8 ms between moves, time is left of the 80 ms until
// rest. As the pipeline has it: a camera that is so slow is lost.
constexpr Duration kGrace = milliseconds(45);
constexpr Duration kMinInterval = milliseconds(8);
constexpr Duration kSlowestInterval = milliseconds(250);

SpnavHello hello_of(const SpnavOptions& options) noexcept {
  SpnavHello hello;
  hello.device.vendor = options.vendor;
  hello.device.product = options.product;
  options.name.copy(hello.device.name.data(), hello.device.name.size() - 1);
  return hello;
}

/// Of the process at the other end, if it is stopped, by a signal or a debugger: it will not answer
/// however long one waits. Else 0.
pid_t stopped_peer(int link) noexcept {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::getsockopt(link, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 || peer.pid <= 0) return 0;
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), "/proc/%d/stat", peer.pid);
  const UniqueFd file(::open(text.data(), O_RDONLY | O_CLOEXEC));
  const ssize_t got = file ? ::read(file.get(), text.data(), text.size()) : 0;
  const std::string_view stat(text.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  const std::size_t name_end = stat.rfind(") ");  // proc(5): pid (name) state
  const bool whole = name_end != std::string_view::npos && name_end + 2 < stat.size();
  const char state = whole ? stat[name_end + 2] : ' ';
  return state == 'T' || state == 't' ? peer.pid : 0;
}

/// Without heap, and cut where there is no more room.
template <typename... Args>
std::string_view write_line(std::span<char> into, fmt::format_string<Args...> format,
                            Args&&... args) noexcept {
  const auto written =
      fmt::format_to_n(into.data(), into.size(), format, std::forward<Args>(args)...);
  return {into.data(), std::min(written.size, into.size())};
}

}  // namespace

SpnavOutput::SpnavOutput(const SpnavOptions& options)
    : options_(options),
      path_(spnav_socket_path(options.socket)),
      intervals_{milliseconds(40), milliseconds(40), milliseconds(40)} {
  programs_.reserve(kMaxPrograms);
  // A daemon that is just about to end, or to start, takes another attempt.
  for (int i = 0; i < kAttempts && !welcome_ && !other_bridge_; ++i)
    if (reach_daemon()) await_greeting();
  if (other_bridge_) throw ConfigError(failure());
  if (!welcome_) {
    throw ConfigError(
        "spnav socket {}: its daemon does not answer; `tagwrench spnav --socket {}` in another "
        "terminal says why",
        path_, path_);
  }
}

SpnavOutput::~SpnavOutput() {
  if (welcome_) send_spnav(link_.get(), SpnavUpdate{});
  if (daemon_ > 0) ::waitpid(daemon_, nullptr, WNOHANG);
}

/// Connects, to a daemon that is started if there is none.
bool SpnavOutput::reach_daemon() {
  link_ = connect_spnav_bridge(path_);
  if (link_) return true;
  if (const std::optional<SpnavSockets> sockets = listen_spnav(path_)) start_daemon(*sockets);
  link_ = connect_spnav_bridge(path_);
  return static_cast<bool>(link_);
}

void SpnavOutput::start_daemon(const SpnavSockets& sockets) {
  if (daemon_ > 0) ::waitpid(daemon_, nullptr, WNOHANG);
  daemon_ = 0;
  const int inherited[] = {sockets.programs.get(), sockets.bridge.get()};
  const int failed = spawn_daemon(daemon_, options_.program,
                                  {"tagwrench", "spnav", "--socket", path_, "--inherited",
                                   fmt::format("{},{}", kFirstDaemonFd, kFirstDaemonFd + 1)},
                                  inherited, DaemonSignals::delivered);
  if (failed == 0) return;
  sockets.remove();
  throw ConfigError(
      "spnav socket {}: its daemon {} cannot be started: {}; end other programs, or run without "
      "the output spnav",
      path_, options_.program, std::strerror(failed));
}

void SpnavOutput::await_greeting() {
  const TimePoint until = steady_clock::now() + kStartTime;
  for (TimePoint now; link_ && !welcome_ && (now = steady_clock::now()) < until;) {
    pollfd entry{link_.get(), POLLIN, 0};
    const auto left = std::min(std::chrono::ceil<milliseconds>(until - now), kLookEvery);
    const bool answered = ::poll(&entry, 1, static_cast<int>(left.count())) > 0;
    if (answered) service();
    if (other_bridge_) return;
    if (const pid_t stopped = answered ? 0 : stopped_peer(link_.get()); stopped != 0) {
      throw ConfigError(
          "spnav socket {}: its daemon (process {}) is stopped; let it go on with `kill -CONT {}`",
          path_, stopped, stopped);
    }
  }
}

SendStatus SpnavOutput::move(const Sample& sample) noexcept {
  if (other_bridge_) return SendStatus::failed;
  const TimePoint now = steady_clock::now();
  SpnavUpdate update;
  update.valid_ms = valid_ms(now);
  if (carries_numbers(shown_status(sample))) {
    update.state.motion = spnav_counts(sample.deflection);
    update.state.buttons = sample.buttons & ((std::uint32_t{1} << kSpnavButtons) - 1);
  }
  if (!link_ && now >= next_attempt_) {
    next_attempt_ = now + kBetweenAttempts;
    try {
      reach_daemon();
    } catch (const std::exception&) {  // what is in the way may go away
    }
  }
  if (!welcome_) return SendStatus::skipped;
  const SpnavState rest;
  if (update.state == rest && last_ == rest) return SendStatus::ok;
  if (!send_spnav(link_.get(), update)) return SendStatus::skipped;
  last_ = update.state;
  return SendStatus::ok;
}

/// Until when this move holds: the median of three intervals, and some grace.
std::uint32_t SpnavOutput::valid_ms(TimePoint now) noexcept {
  intervals_ = {intervals_[1], intervals_[2],
                std::clamp<Duration>(now - last_move_, kMinInterval, kSlowestInterval)};
  last_move_ = now;
  std::array<Duration, 3> sorted = intervals_;
  std::sort(sorted.begin(), sorted.end());
  return static_cast<std::uint32_t>(std::chrono::ceil<milliseconds>(sorted[1] + kGrace).count());
}

std::string SpnavOutput::failure() const {
  const std::int32_t pid = other_bridge_.value_or(0);
  return fmt::format(
      "spnav socket {}: another bridge{} feeds it already; end that one, or choose another path, "
      "as in --output spnav:PATH",
      path_, pid > 0 ? fmt::format(" (process {})", pid) : "");
}

std::string SpnavOutput::advice() const {
  if (path_ == kSpnavSystemSocket) return "spnav: serving " + path_;
  return fmt::format("spnav: programs find it when started with SPNAV_SOCKET={}", path_);
}

std::string_view SpnavOutput::service() noexcept {
  if (!link_) return {};
  std::array<std::uint8_t, kSpnavLongestMessage> buffer;
  const SpnavReceived received = receive_spnav(link_.get(), buffer);
  if (!received.open) return lost_daemon();
  if (received.bytes.empty()) return {};
  if (const auto greeting = spnav_message<SpnavGreeting>(received.bytes)) {
    welcome_ = greeting->refused == 0 && send_spnav(link_.get(), hello_of(options_));
    if (greeting->refused == 0) return {};
    other_bridge_ = greeting->other_bridge;
    link_.reset();
    return {};
  }
  if (const auto program = spnav_message<SpnavProgram>(received.bytes)) return take(*program);
  lost_daemon();
  return write_line(
      status_line_,
      "spnav: the daemon is of another version of tagwrench; end it with `pkill tw-spnav`");
}

std::string_view SpnavOutput::lost_daemon() noexcept {
  const bool was_welcome = welcome_;
  link_.reset();
  welcome_ = false;
  last_ = {};
  programs_.clear();
  if (!was_welcome) return {};
  return write_line(status_line_,
                    "spnav: the daemon of the socket has ended; starting another. Programs that "
                    "were connected find it when they are started again");
}

std::string_view SpnavOutput::take(const SpnavProgram& program) noexcept {
  SpnavPeer peer = program.peer;
  peer.name.back() = '\0';
  std::replace_if(
      peer.name.begin(), peer.name.end() - 1, [](char c) { return c > 0 && c < ' '; }, '?');
  if (program.connected != 0) {
    if (programs_.size() < kMaxPrograms) programs_.push_back(peer);
    return write_line(status_line_, "spnav: {} (process {}) has connected", peer.name.data(),
                      peer.pid);
  }
  const auto it = std::find_if(programs_.begin(), programs_.end(),
                               [&](const SpnavPeer& known) { return known.pid == peer.pid; });
  if (it != programs_.end()) programs_.erase(it);
  return write_line(status_line_, "spnav: {} (process {}) has gone", peer.name.data(), peer.pid);
}

}  // namespace tagwrench
