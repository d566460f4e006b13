// Room app: one run, put together.
// In:  a source, an instrument (tracker, wrench, motion), outputs, a stop.
// Out: every frame's sample in every output, in order, on one thread; what became of the run.
// Units and frames: core/types.h. The life of a frame: docs/architecture.md.
//
// THE data path, on one screen: frame -> pose -> wrench -> motion -> outputs, and the one poll loop
// that drives it.
#pragma once

#include <poll.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/frame_log.h"
#include "host/core/sleep_watch.h"
#include "host/motion/profile_manager.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"
#include "host/source/frame_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

struct RunLimits {
  std::optional<std::uint64_t> frames;
  std::optional<Duration> time;
};

struct RunReport {
  enum class End : std::uint8_t { limit, source_ended, interrupted, output_failed };
  End end = End::limit;
  std::string failure;             ///< one line, when an output failed
  std::string trouble;             ///< the last line that said why the target is not held
  std::uint64_t frames = 0;        ///< processed
  std::uint64_t with_numbers = 0;  ///< of these, ok or saturated
  std::uint64_t dropped = 0;       ///< lost by the source
  std::uint64_t skipped = 0;       ///< samples that a slow reader lost
  Duration elapsed{};
};

class Pipeline {
 public:
  /// Borrows everything; `stop_fd` becomes readable when the run shall end (of termination_fd()),
  /// -1 for never. `log` is told of every frame; there may be none.
  Pipeline(FrameSource& source, Tracker& tracker, WrenchEstimator& wrench, ProfileManager& profiles,
           std::vector<Output*> outputs, Watchdog& watchdog, int stop_fd, FrameLog* log = nullptr);

  /// Takes the zero off every sample; without it the wrench stays as it is estimated. Borrowed.
  void follow_zero(ZeroTracking& zero) noexcept { zero_ = &zero; }

  /// Runs until a limit, the source's end, a stop or a failed output. Does not throw on account of
  /// the outside world.
  RunReport run(const RunLimits& limits);
  /// While it runs, for its own thread.
  const RunReport& so_far() const noexcept { return report_; }

 private:
  void step(Frame& frame) noexcept;
  void send(Sample& sample, std::optional<Duration> recorded_latency) noexcept;
  void send_neutral(std::optional<Duration> recorded_latency) noexcept;
  void move(const Sample& sample) noexcept;
  void move_on(TimePoint now) noexcept;
  void note(SendStatus status, const Output& output) noexcept;
  std::uint32_t pressed() const noexcept;
  void follow_zero(Sample& sample, const Vector6& noise) noexcept;
  void guard() noexcept;
  bool read_source() noexcept;
  void note_arrival(TimePoint now) noexcept;
  void wait(TimePoint until) noexcept;
  void say(std::string_view line) noexcept;
  void say_diagnostic(const Track& track) noexcept;
  TimePoint wake_time(const RunLimits& limits) const noexcept;
  TimePoint missing_at() const noexcept;

  FrameSource& source_;
  Tracker& tracker_;
  WrenchEstimator& wrench_;
  ProfileManager& profiles_;
  std::vector<Output*> outputs_;
  std::vector<pollfd> polled_;  ///< source, stop, profiles, then each output
  Watchdog& watchdog_;
  int stop_fd_;
  FrameLog* log_;
  ZeroTracking* zero_ = nullptr;
  SleepWatch sleep_{time_asleep()};

  TimePoint start_{};
  TimePoint last_arrival_{};
  TimePoint next_move_ = TimePoint::max();  ///< of devices that move at a rate of their own
  std::array<Duration, 3> intervals_;       ///< the last three between frames
  Duration interval_;                       ///< to be expected, at least the announced period
  bool neutral_ = true;
  bool source_ready_ = false;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool trouble_shown_ = false;  ///< since the target was last held
  Sample last_sample_;
  RunReport report_;
  std::optional<RunReport::End> end_;
};

}  // namespace tagwrench
