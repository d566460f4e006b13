#include "host/app/recording.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>

#include "host/app/recording_sensor.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/os/atomic_file.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr int kLineSeconds = 2;

std::string bytes_text(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.3g} GB", bytes / 1e9);
  return fmt::format("{:.3g} MB", bytes / 1e6);
}

std::string time_text(double seconds) {
  if (seconds >= 2 * 86400) return fmt::format("{:.0f} days", seconds / 86400);
  if (seconds >= 2 * 3600) return fmt::format("{:.0f} h", seconds / 3600);
  if (seconds >= 2 * 60) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.0f} s", seconds);
}

double in_seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

void check_recording(const RecordOptions& options, std::string_view option) {
  const fs::path path = options.file;
  std::error_code error;
  if (fs::exists(fs::symlink_status(path, error))) {
    throw ConfigError(
        fmt::format("{} {}: exists, and a recording replaces nothing; choose another name", option,
                    options.file));
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (::access(folder.c_str(), W_OK) != 0) {
    throw ConfigError(fmt::format("{} {}: cannot be written: {}; choose a folder of yours", option,
                                  options.file, std::strerror(errno)));
  }
}

record::Head recording_head(const Input& input, record::Keep keep) {
  const SourceFormat& format = input.source->format();
  record::Head head;
  head.created = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  head.software = TAGWRENCH_VERSION;
  head.source = format.description;
  head.width = format.width;
  head.height = format.height;
  head.period = format.period;
  head.keep = keep;
  if (input.recorded) {
    head.sensor_name = input.recorded->sensor_name;
    head.sensor_yaml = input.recorded->sensor_yaml;
    head.appearance = input.recorded->appearance;
    head.calibration = input.recorded->calibration;
    head.measured = input.recorded->measured;
  } else {
    const bool is_file = input.sensor_text.empty();
    take_sensor(input.sensor_name, is_file ? read_text(input.sensor_name) : input.sensor_text,
                head);
  }
  return head;
}

Recording::Recording(const RecordOptions& options, const record::Head& head, bool lossless,
                     std::optional<std::uint64_t> frames, std::optional<Duration> time)
    : FrameRecorder({.path = options.file, .lossless = lossless}, head),
      file_(options.file),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      frames_(frames),
      time_(time),
      start_(std::chrono::steady_clock::now()),
      last_line_(start_) {
  itimerspec every{};
  every.it_interval.tv_sec = every.it_value.tv_sec = kLineSeconds;
  ::timerfd_settime(timer_.get(), 0, &every, nullptr);
}

SendStatus Recording::send(const Sample& sample) noexcept {
  dropped_ += sample.dropped;
  return writer().state().failed ? SendStatus::failed : SendStatus::ok;
}

/// What people are told is kept too, but for its own progress.
bool Recording::notice(std::string_view line) noexcept {
  if (line.data() != line_.data()) note(line);
  return false;
}

std::string_view Recording::service() noexcept {
  std::uint64_t ticks = 0;
  if (::read(timer_.get(), &ticks, sizeof ticks) <= 0) return {};
  try {
    line_ = progress();
    return line_;
  } catch (const std::exception&) {
    return {};  // out of memory: unsaid
  }
}

std::string Recording::progress() {
  const TimePoint now = std::chrono::steady_clock::now();
  const record::WriterState state = writer().state();
  const double elapsed = in_seconds(now - start_);
  const double rate = static_cast<double>(state.frames - last_frames_) /
                      std::max(1e-3, in_seconds(now - last_line_));
  const double speed = static_cast<double>(state.bytes) / std::max(1e-3, elapsed);
  last_frames_ = state.frames;
  last_line_ = now;
  std::string line = fmt::format("recording: {:.1f} frames/s, {} dropped", rate, dropped_);
  if (state.lost_frames > 0 || state.lost_others > 0) {
    line += fmt::format(", {} and {} lost by a slow disk", count_text(state.lost_frames, "frame"),
                        count_text(state.lost_others, "other row"));
  }
  line += fmt::format(", {} at {}/s, {} left on the disk ({})",
                      bytes_text(static_cast<double>(state.bytes)), bytes_text(speed),
                      bytes_text(static_cast<double>(state.disk_free)),
                      time_text(static_cast<double>(state.disk_free) / std::max(1.0, speed)));
  if (state.fill > 0.1) line += fmt::format(", buffer {:.0f} % full", 100 * state.fill);
  std::optional<double> left;
  if (time_) left = in_seconds(*time_) - elapsed;
  if (frames_ && rate > 0) {
    const double of_frames =
        (static_cast<double>(*frames_) - static_cast<double>(state.frames)) / rate;
    left = left ? std::min(*left, of_frames) : of_frames;
  }
  if (left) line += fmt::format(", {} to go", time_text(std::max(0.0, *left)));
  return line;
}

std::string Recording::summary() const {
  const record::WriterState state = writer().state();
  std::string line = fmt::format("{}: {}, {}", file_, count_text(state.frames, "frame"),
                                 bytes_text(static_cast<double>(state.bytes)));
  if (state.lost_frames > 0 || state.lost_others > 0) {
    line += fmt::format("; the disk was too slow for {} and {}; --keep region keeps less",
                        count_text(state.lost_frames, "frame"),
                        count_text(state.lost_others, "other row"));
  }
  return line;
}

}  // namespace tagwrench
