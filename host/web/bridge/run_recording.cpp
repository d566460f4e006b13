#include "host/web/bridge/run_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>

namespace tagwrench {
namespace {

constexpr double kMaxLeft_s = 1e7;

}  // namespace

RunRecording::RunRecording(const std::filesystem::path& file, const record::Head& head)
    : FrameRecorder({.path = file}, head), file_(file), start_(std::chrono::steady_clock::now()) {}

void RunRecording::frame(const LoggedFrame& all) noexcept {
  dropped_.fetch_add(all.sample.dropped, std::memory_order_relaxed);
  FrameRecorder::frame(all);
}

nlohmann::json RunRecording::progress() const {
  const record::WriterState state = writer().state();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double speed = static_cast<double>(state.bytes) / std::max(1e-3, seconds);
  const double left = static_cast<double>(state.disk_free) / std::max(1.0, speed);
  return {{"file", name()},
          {"seconds", seconds},
          {"bytes", state.bytes},
          {"frames", state.frames},
          {"dropped", dropped_.load(std::memory_order_relaxed) + state.lost_frames},
          {"disk_left_s", std::min(left, kMaxLeft_s)}};
}

RunRecording::Ending RunRecording::finish() noexcept {
  try {
    const std::string trouble = writer().finish();
    const record::WriterState state = writer().state();
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
