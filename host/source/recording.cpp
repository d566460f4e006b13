#include "host/source/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/timer.h"

namespace tagwrench {

using record::Entry;
using record::Keep;

RecordingSource::RecordingSource(std::unique_ptr<record::RecordingReader> recording, bool fast)
    : recording_(std::move(recording)),
      decoder_(recording_->head().width, recording_->head().height) {
  const record::Head& head = recording_->head();
  const std::string file = recording_->path().string();
  if (head.keep == Keep::none) {
    throw ConfigError(
        "recording:{0}: was made with --keep none and has no pictures to replay; `tagwrench export "
        "{0} --csv FILE` gives its samples",
        file);
  }
  if (recording_->frame_times().empty())
    throw ConfigError("recording:{}: holds no frames; give another one", file);
  format_.width = head.width;
  format_.height = head.height;
  format_.period = head.period;
  const std::vector<TimePoint>& times = recording_->frame_times();
  first_ = times.front();
  const double seconds = std::chrono::duration<double>(times.back() - first_).count();
  format_.description =
      fmt::format("{}: {} {} in {:.4g} s, {}x{}, of {} ({}){}", file, times.size(),
                  times.size() == 1 ? "frame" : "frames", seconds, head.width, head.height,
                  head.source, head.created, fast ? ", as fast as they can go" : "");
  if (const auto unclosed = recording_->unclosed(); !unclosed.empty())
    format_.description += fmt::format("; it {}", unclosed);
  picture_.resize(static_cast<std::size_t>(head.width) * static_cast<std::size_t>(head.height));
  if (fast) return;
  timer_ = monotonic_timer();
  if (!timer_) throw ConfigError("recording:{}: no more file descriptors; raise ulimit -n", file);
  arm();
}

/// Makes entry_ the next one. False: there is none.
bool RecordingSource::advance() noexcept {
  if (waiting_) return true;
  if (!damage_.empty()) return false;
  try {
    waiting_ = recording_->next(entry_);
  } catch (const std::exception& e) {
    damage_ = e.what();
  }
  return waiting_;
}

void RecordingSource::arm() const noexcept {
  // At once for the first entry, which starts the clock, and for the end.
  if (timer_) wake_at(timer_, started_ && waiting_ ? due() : TimePoint{});
}

ReadStatus RecordingSource::read(Frame& frame) noexcept {
  if (!advance()) return ReadStatus::end;
  const TimePoint now = std::chrono::steady_clock::now();
  if (!std::exchange(started_, true)) start_ = now;
  if (timer_) {
    if (now < due()) {
      arm();
      return ReadStatus::nothing;
    }
    pass_late(now);
    if (!waiting_) return ReadStatus::end;
  }
  frame.recorded_latency = entry_.latency;
  waiting_ = false;
  ReadStatus status = ReadStatus::missing;
  if (entry_.kind == Entry::Kind::disconnected || entry_.kind == Entry::Kind::reconnected) {
    detail_ = std::move(entry_.text);
    status = entry_.kind == Entry::Kind::disconnected ? ReadStatus::disconnected
                                                      : ReadStatus::reconnected;
  }
  if (entry_.kind == Entry::Kind::frame) {
    ++frame_;
    frame.capture_time = entry_.time;
    frame.latency_origin = now;
    frame.sequence = entry_.sequence;
    frame.touched = entry_.touched;
    frame.dropped = entry_.dropped + passed_;
    status = decode(frame) ? ReadStatus::frame : ReadStatus::nothing;
    if (status == ReadStatus::frame) {
      passed_ = 0;
    } else {
      ++unusable_;
      passed_ += entry_.dropped + 1;
    }
  }
  // At once, to see what comes next: entry_ is still what raw() and complete() refer to.
  arm();
  return status;
}

/// The newest frame that is due counts, as with a camera: others are passed over.
void RecordingSource::pass_late(TimePoint now) noexcept {
  const std::vector<TimePoint>& times = recording_->frame_times();
  while (entry_.kind == Entry::Kind::frame && frame_ + 1 < times.size() &&
         start_ + (times[frame_ + 1] - times.front()) <= now) {
    passed_ += entry_.dropped + 1;
    ++frame_;
    waiting_ = false;
    if (!advance()) return;
  }
}

bool RecordingSource::decode(Frame& frame) noexcept {
  if (entry_.raw.bytes.empty()) return false;
  if (!entry_.crop) return decoder_.decode(entry_.raw, wanted_, frame);
  // Elsewhere the picture holds what earlier frames left there.
  const Region& part = entry_.all;
  const auto width = static_cast<std::size_t>(part.width);
  for (int y = 0; y < part.height; ++y) {
    const auto row = static_cast<std::ptrdiff_t>(part.y + y) * format_.width + part.x;
    std::copy_n(entry_.raw.bytes.data() + static_cast<std::size_t>(y) * width, width,
                picture_.begin() + row);
  }
  frame.image = {picture_.data(), format_.width, format_.height, format_.width};
  frame.decoded = entry_.first;
  return true;
}

bool RecordingSource::complete(Frame& frame) noexcept {
  const Region whole{0, 0, format_.width, format_.height};
  if (frame.readable() == whole) return true;
  if (!entry_.crop) return decoder_.decode(entry_.raw, whole, frame);
  if (entry_.all == frame.readable()) return false;
  frame.decoded = entry_.all;
  return true;
}

RawFrame RecordingSource::raw() const noexcept { return entry_.crop ? RawFrame{} : entry_.raw; }

std::string RecordingSource::unusable() const {
  if (!damage_.empty()) return damage_;
  if (unusable_ == 0) return {};
  return fmt::format("{}: {} frames have no pixels or damaged ones, and were skipped",
                     recording_->path().string(), unusable_);
}

}  // namespace tagwrench
