#include "host/output/service_watch.h"

#include <sys/timerfd.h>
#include <systemd/sd-daemon.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

// One after the other, systemd takes them as they come; a message that is lost is not worth more.
void tell_systemd(const char* state) noexcept { sd_notify(0, state); }

void tell_status(const char* before, std::string_view status) noexcept {
  constexpr int kMax = 200;
  sd_notifyf(0, "%sSTATUS=%.*s", before,
             static_cast<int>(status.size() < kMax ? status.size() : kMax), status.data());
}

/// Rings twice in the time in which systemd wants a sign of life, as sd_watchdog_enabled(3)
/// advises.
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

}  // namespace

std::unique_ptr<ServiceWatch> ServiceWatch::open() {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return nullptr;
  return std::unique_ptr<ServiceWatch>(new ServiceWatch(watchdog_timer()));
}

ServiceWatch::~ServiceWatch() { tell_systemd("STOPPING=1"); }

void ServiceWatch::ready(std::string_view status) noexcept { tell_status("READY=1\n", status); }

std::string_view ServiceWatch::service() noexcept {
  std::uint64_t rings = 0;
  if (::read(timer_.get(), &rings, sizeof rings) == sizeof rings) tell_systemd("WATCHDOG=1");
  return {};
}

bool ServiceWatch::notice(std::string_view line) noexcept {
  tell_status("", line.empty() ? "running" : line);
  return false;
}

}  // namespace tagwrench
