#include "host/web/bridge/run_control.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

[[noreturn]] void no_descriptor() {
  throw ConfigError(std::string("--output web: no descriptor to be had: ") + std::strerror(errno) +
                    "; end other programs");
}

}  // namespace

UniqueFd make_event() {
  UniqueFd event(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!event) no_descriptor();
  return event;
}

void raise_event(const UniqueFd& event) noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(event.get(), &one, sizeof one);
}

void clear_event(const UniqueFd& event) noexcept {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(event.get(), &count, sizeof count);
}

RunControl::RunControl(int stop)
    : camera_wanted_(make_event()),
      requests_ready_(make_event()),
      end_(::epoll_create1(EPOLL_CLOEXEC)) {
  if (!end_) no_descriptor();
  for (const int fd : {stop, camera_wanted_.get()}) {
    epoll_event event{};
    event.events = EPOLLIN;
    if (::epoll_ctl(end_.get(), EPOLL_CTL_ADD, fd, &event) != 0) no_descriptor();
  }
}

void RunControl::request(Request request) {
  {
    const std::lock_guard lock(mutex_);
    if (open_) {
      requests_.push_back(std::move(request));
      raise_event(requests_ready_);
      return;
    }
  }
  request(nullptr);
}

void RunControl::want_camera() noexcept { raise_event(camera_wanted_); }

void RunControl::camera_given() noexcept { clear_event(camera_wanted_); }

void RunControl::open() {
  const std::lock_guard lock(mutex_);
  open_ = true;
}

std::vector<RunControl::Request> RunControl::take() noexcept {
  const std::lock_guard lock(mutex_);
  return std::exchange(requests_, {});
}

void RunControl::run_requests(WebOutput& output) noexcept {
  clear_event(requests_ready_);
  for (const Request& request : take()) request(&output);
}

void RunControl::close() noexcept {
  {
    const std::lock_guard lock(mutex_);
    open_ = false;
  }
  for (const Request& request : take()) request(nullptr);
}

}  // namespace tagwrench
