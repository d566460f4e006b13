#include "host/web/bridge/run_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>

namespace tagwrench {
namespace {

constexpr double kLongestLeft_s = 1e7;

}  // namespace

RunRecording::RunRecording(const std::filesystem::path& file, const record::Head& head)
    : file_(file), writer_({.path = file}, head), start_(std::chrono::steady_clock::now()) {}

void RunRecording::frame(const LoggedFrame& all) noexcept {
  clock_ = all.frame.capture_time - all.frame.latency_origin;
  dropped_.fetch_add(all.sample.dropped, std::memory_order_relaxed);
  writer_.frame(all.frame, all.decoded, all.raw);
  writer_.track(all.track);
  writer_.sample(all.sample);
}

void RunRecording::missing(const Sample& sample) noexcept { writer_.missing(sample); }

void RunRecording::disconnected(std::string_view detail) noexcept {
  writer_.event(record::EventKind::disconnected, now_of_frames(), detail);
}

void RunRecording::reconnected(std::string_view detail) noexcept {
  writer_.event(record::EventKind::reconnected, now_of_frames(), detail);
}

void RunRecording::note(std::string_view line) noexcept {
  if (!line.empty()) writer_.event(record::EventKind::note, now_of_frames(), line);
}

TimePoint RunRecording::now_of_frames() const noexcept {
  return std::chrono::steady_clock::now() + clock_;
}

nlohmann::json RunRecording::progress() const {
  const record::WriterState state = writer_.state();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double speed = static_cast<double>(state.bytes) / std::max(1e-3, seconds);
  const double left = static_cast<double>(state.disk_free) / std::max(1.0, speed);
  return {{"file", name()},
          {"seconds", seconds},
          {"bytes", state.bytes},
          {"frames", state.frames},
          {"dropped", dropped_.load(std::memory_order_relaxed) + state.lost_frames},
          {"disk_left_s", std::min(left, kLongestLeft_s)}};
}

RunRecording::Ending RunRecording::finish() noexcept {
  try {
    const std::string trouble = writer_.finish();
    const record::WriterState state = writer_.state();
    if (!trouble.empty()) return {false, trouble};
    std::string line = fmt::format("{}: {} frames, {:.3g} MB", file_.string(), state.frames,
                                   1e-6 * static_cast<double>(state.bytes));
    if (state.lost_frames > 0)
      line += fmt::format("; the disk was too slow for {} of them", state.lost_frames);
    return {true, line};
  } catch (const std::exception&) {
    return {false, {}};  // out of memory: unsaid
  }
}

}  // namespace tagwrench
