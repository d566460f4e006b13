#include "host/source/v4l2_source.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/epoll.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>

#include "host/core/config_error.h"
#include "host/core/os/timer.h"
#include "host/source/v4l2_device.h"

namespace tagwrench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr Duration kRetryEvery = 500ms;
constexpr Duration kReopenAfter = 2s;  ///< an open camera that gives no frame is opened afresh
constexpr int kSettleFrames = 20;
constexpr int kClockFrames = 3;  ///< enough to judge the driver's clock if nothing has to settle
constexpr Duration kSettleAtMost = 1500ms;
constexpr double kExposureUnit_us = 100;  ///< of V4L2_CID_EXPOSURE_ABSOLUTE

int milliseconds_left(TimePoint until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  return static_cast<int>(std::max<std::int64_t>(0, left));
}

V4l2Choice choose(const V4l2Device& device, const V4l2Options& options) {
  const bool asked = options.width > 0;
  const auto modes = device.modes(asked ? options.width : options.preferred_width,
                                  asked ? options.height : options.preferred_height);
  const auto choice = choose_mode(modes, options);
  if (choice) return *choice;
  if (modes.empty()) {
    throw ConfigError(
        "{}: {} offers no pixel format of GREY, YUYV, UYVY, NV12, MJPG; choose another camera, or "
        "start what feeds it first",
        options.path, device.capability().card);
  }
  std::string request = asked ? fmt::format("{}x{}", options.width, options.height) : "such a mode";
  if (options.fps > 0) request += fmt::format("@{:.4g}", options.fps);
  if (options.pixels) request += fmt::format(" {}", name(*options.pixels));
  throw ConfigError("{}: the camera does not have {}; it has {}", options.path, request,
                    describe(modes, 8));
}

/// A larger jump is a driver's mistake: the source would have been called stalled long before.
constexpr std::uint32_t kMaxGap = 4096;
constexpr Duration kAbsurdAge = 1s;

}  // namespace

V4l2Source::V4l2Source(const V4l2Options& options)
    : path_(options.path), stable_path_(stable_path(options.path)), capture_queue_(Duration{}) {
  device_ = std::make_unique<V4l2Device>(path_);
  choice_ = choose(*device_, options);
  epoll_.reset(::epoll_create1(EPOLL_CLOEXEC));
  timer_ = monotonic_timer();
  if (!epoll_ || !timer_) throw ConfigError("{}: no more file descriptors; raise ulimit -n", path_);
  watch(timer_.get());
  const V4l2Stream stream = device_->set_mode(choice_);
  format_ = {stream.width, stream.height, stream.period, {}};
  capture_queue_ = CaptureQueueTracker(stream.period);
  decoder_.emplace(stream.pixels, stream.width, stream.height, stream.stride);
  stride_ = stream.stride;
  device_->start();
  settle(options.exposure_us);
  watch_camera();
  capture_queue_.number_from_zero();
  last_buffer_ = last_drain_ = Clock::now();
  wake_after(timer_, stall_after());
  const double fps = 1 / std::chrono::duration<double>(stream.period).count();
  format_.description = fmt::format(
      "{} ({}, {}): {}x{} {} at {:.4g} fps, {}; {}", path_, device_->capability().card,
      device_->capability().driver, stream.width, stream.height, name(stream.pixels), fps,
      capture_queue_.trusts_driver_clock() ? "kernel capture times"
                                           : "times of dequeuing (the driver's are not usable)",
      controls_.description());
}

V4l2Source::~V4l2Source() {
  try {
    // A camera that is away may have come back since the last try; it must not keep our settings.
    if (!device_) device_ = V4l2Device::reopen(stable_path_);
    if (!device_) return;
    V4l2ControlPort port(device_->fd());
    controls_.restore(port);
  } catch (const std::exception&) {
    // It stays away: then there is nothing to restore.
  }
}

std::string V4l2Source::unusable() const {
  if (corrupt_ == 0 && stale_ == 0) return {};
  return fmt::format("{} corrupt and {} stale frames were skipped", corrupt_, stale_);
}

CameraLight* V4l2Source::camera_light() noexcept {
  return controls_.locked(V4L2_CID_EXPOSURE_ABSOLUTE) ? this : nullptr;
}

/// Longer than the frame period the camera would lower its frame rate.
CameraLight::Range V4l2Source::exposure_range_us() const noexcept {
  const double period_us = std::chrono::duration<double, std::micro>(format_.period).count();
  return range_of(V4L2_CID_EXPOSURE_ABSOLUTE, kExposureUnit_us, period_us);
}

double V4l2Source::exposure_us() const noexcept {
  return kExposureUnit_us * controls_.locked(V4L2_CID_EXPOSURE_ABSOLUTE).value_or(0);
}

bool V4l2Source::set_exposure_us(double exposure_us) noexcept {
  return set_control(V4L2_CID_EXPOSURE_ABSOLUTE, exposure_us / kExposureUnit_us);
}

CameraLight::Range V4l2Source::gain_range() const noexcept {
  return range_of(V4L2_CID_GAIN, 1, std::numeric_limits<double>::max());
}

double V4l2Source::gain() const noexcept { return controls_.locked(V4L2_CID_GAIN).value_or(0); }

bool V4l2Source::set_gain(double gain) noexcept { return set_control(V4L2_CID_GAIN, gain); }

/// A camera that is away, or a control that is not locked, leaves nothing to set.
CameraLight::Range V4l2Source::range_of(std::uint32_t control, double unit,
                                        double most) const noexcept {
  const double now = unit * controls_.locked(control).value_or(0);
  if (!device_ || !controls_.locked(control)) return {now, now};
  V4l2ControlPort port(device_->fd());
  const auto range = port.range(control);
  if (!range) return {now, now};
  const double least = unit * range->minimum;
  return {least, std::max(least, std::min(most, unit * range->maximum))};
}

bool V4l2Source::set_control(std::uint32_t control, double value) noexcept {
  constexpr double kWide = 1e9;
  return std::isfinite(value) &&
         change_setting(control, std::llround(std::clamp(value, -kWide, kWide)));
}

bool V4l2Source::change_setting(std::uint32_t id, std::int64_t value) noexcept {
  if (!device_) return false;
  V4l2ControlPort port(device_->fd());
  return controls_.change(port, id, value);
}

void V4l2Source::watch(int fd) const {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  if (::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) != 0) {
    throw ConfigError("{}: cannot be waited for: {}; choose a capture device", path_,
                      std::strerror(errno));
  }
}

void V4l2Source::watch_camera() {
  // v4l2loopback joins the waiting list only if no frame is ready at this moment, and else never
  // wakes an epoll set.
  constexpr int kTries = 16;
  for (int tries = 0; tries < kTries; ++tries) {
    V4l2Buffer buffer;
    int error = 0;
    while (device_->dequeue(buffer, error) == V4l2Device::Dequeue::buffer) {
      capture_queue_.note(buffer.stamp, false);
      if (!device_->requeue(buffer.index)) break;
    }
    watch(device_->fd());
    pollfd entry{device_->fd(), POLLIN, 0};
    if (::poll(&entry, 1, 0) <= 0 || tries + 1 == kTries) return;
    ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, device_->fd(), nullptr);
  }
}

void V4l2Source::settle(int exposure_us) {
  V4l2ControlPort port(device_->fd());
  controls_.remember(port);
  capture_queue_.stream_started();
  const int frames = controls_.needs_settling() ? kSettleFrames : kClockFrames;
  const TimePoint until = Clock::now() + kSettleAtMost;
  for (int seen = 0; seen < frames && milliseconds_left(until) > 0;) {
    V4l2Buffer buffer;
    int error = 0;
    const auto got = device_->dequeue(buffer, error);
    if (got == V4l2Device::Dequeue::failed) break;
    if (got == V4l2Device::Dequeue::buffer) {
      if (capture_queue_.note(buffer.stamp, true)) ++seen;
      device_->requeue(buffer.index);
      continue;
    }
    pollfd entry{device_->fd(), POLLIN, 0};
    if (::poll(&entry, 1, milliseconds_left(until)) > 0 && (entry.revents & POLLIN) == 0) break;
  }
  controls_.lock(port, exposure_us);
}

ReadStatus V4l2Source::read(Frame& frame) noexcept {
  const unsigned kept = held_ && device_ ? 1 : 0;
  if (kept > 0) device_->requeue(held_->index);
  held_.reset();
  if (state_ == State::away) return retry();
  return drain(device_->buffer_count() - kept, frame);
}

bool V4l2Source::complete(Frame& frame) noexcept {
  const Region whole{0, 0, format_.width, format_.height};
  return frame.readable() == whole || !held_ ||
         decoder_->decode(held_->bytes, held_->bytes_used, {}, frame.image, frame.decoded);
}

RawFrame V4l2Source::raw() const noexcept {
  if (!held_) return {};
  const std::size_t used = std::min<std::size_t>(held_->bytes_used, held_->bytes.size());
  return {fourcc_of(choice_.mode.pixels), held_->bytes.first(used), stride_};
}

/// `queued`: how many buffers the driver had to fill since the last read().
ReadStatus V4l2Source::drain(unsigned queued, Frame& frame) noexcept {
  std::optional<V4l2Buffer> newest;
  // A camera faster than this loop must not hold it.
  const unsigned at_most = 2 * device_->buffer_count();
  unsigned taken = 0;
  while (taken < at_most) {
    V4l2Buffer buffer;
    int error = 0;
    const auto got = device_->dequeue(buffer, error);
    if (got == V4l2Device::Dequeue::empty) break;
    if (got == V4l2Device::Dequeue::failed) return lose(std::strerror(error));
    ++taken;
    last_buffer_ = buffer.stamp.dequeued;
    const bool usable = capture_queue_.note(buffer.stamp, false) && !buffer.damaged;
    if (newest) device_->requeue(newest->index);
    newest.reset();
    if (usable) {
      newest = buffer;
    } else {
      corrupt_ += buffer.damaged ? 1 : 0;
      device_->requeue(buffer.index);
    }
  }
  if (taken > 0 && state_ == State::streaming) wake_after(timer_, stall_after());
  if (newest) return deliver(*newest, taken >= queued, frame);
  if (taken > 0) return ReadStatus::nothing;
  if (device_->broken()) return lose("the driver reports an error");
  const Duration patience = state_ == State::streaming ? stall_after() : kReopenAfter;
  const Duration silent = Clock::now() - last_buffer_;
  if (silent >= patience) return lose("no frame comes");
  if (state_ == State::streaming)
    wake_after(timer_, patience - silent);
  else
    wake_after(timer_, kRetryEvery, kRetryEvery);
  return ReadStatus::nothing;
}

ReadStatus V4l2Source::deliver(const V4l2Buffer& newest, bool queue_was_full,
                               Frame& frame) noexcept {
  if (state_ == State::waiting) {
    state_ = State::streaming;
    device_->requeue(newest.index);
    wake_after(timer_, stall_after());
    last_drain_ = Clock::now();
    detail_ = fmt::format("{}: the camera is back", stable_path_);
    return ReadStatus::reconnected;
  }
  const TimePoint now = Clock::now();
  const bool stale = capture_queue_.stale(now, last_drain_, queue_was_full);
  last_drain_ = now;
  const bool usable = !stale && decoder_->decode(newest.bytes, newest.bytes_used, wanted_,
                                                 frame.image, frame.decoded);
  if (!usable) {
    ++(stale ? stale_ : corrupt_);
    device_->requeue(newest.index);
    return ReadStatus::nothing;
  }
  held_ = newest;
  frame.capture_time = frame.latency_origin = capture_queue_.capture_time();
  frame.sequence = capture_queue_.sequence();
  frame.dropped = capture_queue_.take();
  return ReadStatus::frame;
}

ReadStatus V4l2Source::lose(const char* why) noexcept {
  const bool first = state_ == State::streaming;
  if (first) {
    detail_ =
        fmt::format("{}: the camera stopped: {}; waiting for it at {}", path_, why, stable_path_);
  }
  state_ = State::away;
  // Explicitly, because the registration would outlive close() wherever a child process shares the
  // descriptor.
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, device_->fd(), nullptr);
  device_.reset();
  wake_after(timer_, kRetryEvery, kRetryEvery);
  return first ? ReadStatus::disconnected : ReadStatus::nothing;
}

ReadStatus V4l2Source::retry() noexcept {
  std::uint64_t ticks = 0;
  if (::read(timer_.get(), &ticks, sizeof ticks) <= 0) return ReadStatus::nothing;
  try {
    auto device = V4l2Device::reopen(stable_path_);
    const V4l2Stream stream = device->set_mode(choice_);
    V4l2ControlPort port(device->fd());
    controls_.relock(port);
    device->start();
    // The driver may pad its rows otherwise this time.
    decoder_.emplace(stream.pixels, stream.width, stream.height, stream.stride);
    stride_ = stream.stride;
    capture_queue_.stream_started();
    device_ = std::move(device);
    watch_camera();
    last_buffer_ = Clock::now();
    state_ = State::waiting;
  } catch (const std::exception&) {
    device_.reset();
    // Not there yet, or not in this mode: the next tick tries again.
  }
  return ReadStatus::nothing;
}

bool CaptureQueueTracker::note(const BufferStamp& stamp, bool prompt) noexcept {
  if (stream_is_new_) {
    stream_is_new_ = false;
    return false;
  }
  // Unsigned difference: right across the wrap at 2^32. A number that stands still or jumps back
  // says nothing.
  const std::uint32_t step = stamp.sequence - driver_sequence_;
  const bool usable = have_driver_sequence_ && step >= 1 && step <= kMaxGap;
  driver_sequence_ = stamp.sequence;
  have_driver_sequence_ = true;
  sequence_ = from_zero_ ? 0 : sequence_ + (usable ? step : 1);
  from_zero_ = false;

  const Duration age = stamp.dequeued - stamp.driver_time;
  if (!stamp.monotonic || age < 0ns || (prompt && age > kAbsurdAge)) trusts_driver_clock_ = false;
  const TimePoint time = trusts_driver_clock_ ? stamp.driver_time : stamp.dequeued;
  capture_time_ = std::max(time, capture_time_ + 1ns);
  return true;
}

bool CaptureQueueTracker::stale(TimePoint now, TimePoint last_drain,
                                bool queue_was_full) const noexcept {
  if (now - capture_time_ > stale_after()) return true;
  return !trusts_driver_clock_ && queue_was_full && now - last_drain > stale_after();
}

std::uint32_t CaptureQueueTracker::take() noexcept {
  const std::uint64_t lost = taken_ ? sequence_ - *taken_ - 1 : 0;
  taken_ = sequence_;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(lost, std::numeric_limits<std::uint32_t>::max()));
}

}  // namespace tagwrench
