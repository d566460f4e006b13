#include "host/web/bridge/web_output.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

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

/// Others show it too.
bool WebOutput::notice(std::string_view line) noexcept {
  if (recording_ != nullptr) recording_->note(line);
  std::vector<std::string> programs;
  if (parts_.programs != nullptr)
    for (const SpnavPeer& peer : parts_.programs->programs())
      programs.emplace_back(peer.name.data());
  parts_.news(std::string(line), std::move(programs));
  return false;
}

void WebOutput::frame(const LoggedFrame& all) noexcept {
  parts_.feed->sample(all.sample, &all.track);
  if (parts_.feed->wants_picture(std::chrono::steady_clock::now())) parts_.feed->picture(all);
  look(all.track, all.sample);
  if (recording_ != nullptr) recording_->frame(all);
  if (next_ != nullptr) next_->frame(all);
}

void WebOutput::missing(const Sample& sample) noexcept {
  parts_.feed->sample(sample, nullptr);
  Track nothing;
  nothing.status = Status::lost;
  look(nothing, sample);
  if (recording_ != nullptr) recording_->missing(sample);
  if (next_ != nullptr) next_->missing(sample);
}

/// The tracker says a trouble now and then; it holds until the target is held.
void WebOutput::look(const Track& track, const Sample& sample) noexcept {
  seen_.status = sample.status;
  seen_.zero_state = sample.zero_state;
  seen_.corners = track.corners;
  seen_.corner_count = track.corner_count;
  seen_.residual_fraction = track.residual_fraction;
  if (skipped_ != nullptr) seen_.skipped = *skipped_;
  if (track.status == Status::ok) {
    seen_.trouble = Diagnostic::none;
  } else if (is_trouble(track.diagnostic)) {
    seen_.trouble = track.diagnostic;
    seen_.details = track.details;
  }
  parts_.views->seen.put(seen_);
  if (parts_.board != nullptr) parts_.views->board.put(parts_.board->reading());
}

}  // namespace tagwrench
