#include "host/output/watchdog.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <systemd/sd-daemon.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "host/core/config_error.h"
#include "host/core/os/child_process.h"
#include "host/core/os/uninterrupted.h"

namespace tagwrench {

// Two processes meet here; lock-free atomics work across them, locks would not survive a SIGKILL.
struct Watchdog::Shared {
  std::atomic<std::int64_t> deadline_ns{0};  ///< CLOCK_MONOTONIC, or one of the two values below
  std::atomic<bool> dismissed{false};
};

namespace {

// A message to systemd that is lost is not worth more.
void tell_status(const char* before, std::string_view status) noexcept {
  constexpr int kMax = 200;
  sd_notifyf(0, "%sSTATUS=%.*s", before,
             static_cast<int>(status.size() < kMax ? status.size() : kMax), status.data());
}

/// Rings twice in the time that systemd gives for a sign of life; see sd_watchdog_enabled(3).
UniqueFd watchdog_timer() {
  std::uint64_t limit_us = 0;
  if (sd_watchdog_enabled(0, &limit_us) <= 0) return {};
  UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
  const auto half_us = static_cast<std::int64_t>(limit_us / 2);
  itimerspec times{};
  times.it_interval.tv_sec = half_us / 1'000'000;
  times.it_interval.tv_nsec = half_us % 1'000'000 * 1000;
  times.it_value = times.it_interval;
  if (!timer || ::timerfd_settime(timer.get(), 0, &times, nullptr) != 0)
    throw ConfigError(std::string("watchdog: no timer to be had: ") + std::strerror(errno) +
                      "; end other programs, or set WatchdogSec=0 in the unit");
  return timer;
}

constexpr std::int64_t kStandingDown = 0;
constexpr std::int64_t kMissed = -1;  ///< neutral is written; wait for the bridge to come back
constexpr char kReady = 'r';

static_assert(std::atomic<std::int64_t>::is_always_lock_free);
static_assert(std::atomic<bool>::is_always_lock_free);

// From here to the end of the namespace: the watchdog's side. It is forked from a process that may
// have threads, so it makes async-signal-safe calls only (and prctl, a plain system call): no
// allocation, no lock, no locale.

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void write_once(int fd, const std::vector<std::uint8_t>& bytes) {
  if (bytes.empty()) return;
  // A device that refuses is gone already; there is nobody to tell.
  [[maybe_unused]] const ssize_t written = ::write(fd, bytes.data(), bytes.size());
}

void write_neutral(const std::vector<WatchdogDevice>& devices) {
  for (const WatchdogDevice& device : devices)
    for (const std::vector<std::uint8_t>& bytes : device.neutral) write_once(device.fd, bytes);
}

/// Sleeps until `until_ns` (negative: for ever) or a word of the bridge. False: the bridge is gone.
bool sleep_until(int link, std::int64_t until_ns) {
  pollfd waiting{link, POLLIN, 0};
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - now_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  if (ppoll(&waiting, 1, until_ns < 0 ? nullptr : &left, nullptr) <= 0) return true;
  char words[64];
  const ssize_t got = recv(link, words, sizeof words, MSG_DONTWAIT);
  return got > 0 || (got < 0 && (errno == EAGAIN || errno == EINTR));
}

/// The watchdog's life, until the bridge is gone.
void guard(int link, std::atomic<std::int64_t>& deadline_ns,
           const std::vector<WatchdogDevice>& devices) {
  send(link, &kReady, 1, MSG_NOSIGNAL);
  while (true) {
    std::int64_t deadline = deadline_ns.load();
    const bool armed = deadline > 0;
    if (!armed || now_ns() < deadline) {
      if (!sleep_until(link, armed ? deadline : -1)) return;
    } else if (deadline_ns.compare_exchange_strong(deadline, kMissed)) {
      // Had the bridge moved the deadline meanwhile, it would live, and the loop look again.
      write_neutral(devices);
    }
  }
}

}  // namespace

Watchdog::Watchdog(const std::vector<WatchdogDevice>& devices) {
  if (devices.empty()) return;
  const auto fail = [](const char* what) {
    throw ConfigError(std::string("watchdog: ") + what + ": " + std::strerror(errno) +
                      "; end other programs, or run without HID outputs");
  };

  int ends[2];
  // A socket pair and not a pipe: it can be written without SIGPIPE if the watchdog is gone.
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail("cannot make a socket");
  link_.reset(ends[0]);
  UniqueFd watchdog_end(ends[1]);
  void* page =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) fail("cannot share memory");
  shared_ = new (page) Shared;

  std::vector<int> kept{watchdog_end.get()};
  for (const WatchdogDevice& device : devices) kept.push_back(device.fd);
  std::sort(kept.begin(), kept.end());

  // All signals stay blocked in the watchdog: from the first only the link (and SIGKILL) ends it.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  watchdog_ = _Fork();
  if (watchdog_ != 0) {
    const int error = errno;
    char ready = 0;
    watchdog_end.reset();
    if (watchdog_ > 0 && recv(link_.get(), &ready, 1, 0) != 1) waitpid(watchdog_, nullptr, 0);
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    if (ready == kReady) return;
    munmap(page, sizeof(Shared));
    errno = error;
    fail("cannot start the watchdog process");
  }

  setsid();
  prctl(PR_SET_NAME, "tw-watchdog");
  close_all_but(kept);  // the other end of the link among them
  guard(watchdog_end.get(), shared_->deadline_ns, devices);
  if (!shared_->dismissed.load()) {
    write_neutral(devices);
    for (const WatchdogDevice& device : devices) write_once(device.fd, device.destroy);
  }
  _exit(0);
}

Watchdog::~Watchdog() {
  if (watchdog_ <= 0) return;
  shared_->dismissed.store(true);
  link_.reset();
  uninterrupted([this] { return waitpid(watchdog_, nullptr, 0); });
  munmap(shared_, sizeof(Shared));
}

void Watchdog::expect_by(TimePoint deadline) noexcept {
  if (watchdog_ <= 0) return;
  const std::int64_t next_ns = std::max<std::int64_t>(deadline.time_since_epoch().count(), 1);
  const std::int64_t before_ns = shared_->deadline_ns.exchange(next_ns);
  // A watchdog that sleeps until an earlier deadline looks again by itself.
  if (before_ns > 0 && before_ns <= next_ns) return;
  const char word = 1;
  send(link_.get(), &word, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
}

void Watchdog::stand_down() noexcept {
  if (watchdog_ > 0) shared_->deadline_ns.store(kStandingDown);
}

std::unique_ptr<ServiceWatch> ServiceWatch::open() {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return nullptr;
  return std::unique_ptr<ServiceWatch>(new ServiceWatch(watchdog_timer()));
}

ServiceWatch::~ServiceWatch() { sd_notify(0, "STOPPING=1"); }

void ServiceWatch::ready(std::string_view status) noexcept { tell_status("READY=1\n", status); }

std::string_view ServiceWatch::service() noexcept {
  std::uint64_t rings = 0;
  if (::read(timer_.get(), &rings, sizeof rings) == sizeof rings) sd_notify(0, "WATCHDOG=1");
  return {};
}

bool ServiceWatch::notice(std::string_view line) noexcept {
  tell_status("", line.empty() ? "running" : line);
  return false;
}

}  // namespace tagwrench
