// Room app: one run, put together.
// In:  a source, an instrument (tracker, wrench, motion), outputs, a stop.
// Out: every frame's sample in every output, in order, on one thread; what became of the run.
// Units and frames: core/types.h. The life of a frame: docs/architecture.md.
//
// THE data path, on one screen: frame -> pose -> wrench -> motion -> outputs, and the one poll loop
// that drives it.
#pragma once

#include <poll.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/app/frame_watch.h"
#include "host/app/output_scheduler.h"
#include "host/app/status_lines.h"
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

  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Takes the zero off every sample; without it the wrench stays as it is estimated. Borrowed.
  void follow_zero(ZeroTracking& zero) noexcept { zero_ = &zero; }

  /// Runs until a limit, the source's end, a stop or a failed output. Does not throw on account of
  /// the outside world.
  RunReport run(const RunLimits& limits);
  /// While it runs, for its own thread.
  const RunReport& so_far() const noexcept { return report_; }

 private:
  void step(Frame& frame) noexcept;
  void miss(std::optional<Duration> recorded_latency) noexcept;
  void change(ReadStatus status, std::optional<Duration> recorded_latency) noexcept;
  void wait(TimePoint until) noexcept;
  void follow_zero(Sample& sample, const Vector6& noise) noexcept;
  Sample moved_on(TimePoint now) noexcept;
  void note(SendStatus status, const Output& output) noexcept;
  bool live() const noexcept { return source_.poll_fd() >= 0; }
  TimePoint missing_at() const noexcept;

  FrameSource& source_;
  Tracker& tracker_;
  WrenchEstimator& wrench_;
  ProfileManager& profiles_;
  std::vector<Output*> outputs_;
  int stop_fd_;
  FrameLog* log_;
  ZeroTracking* zero_ = nullptr;
  SleepWatch sleep_{time_asleep()};
  FrameWatch frames_;
  OutputScheduler scheduler_;
  StatusLines lines_{outputs_};

  std::vector<pollfd> polled_;  ///< source, stop, profiles, then each output
  bool source_ready_ = false;
  Sample last_sample_;
  bool neutral_ = true;  ///< all that others see is
  RunReport report_;
  std::optional<RunReport::End> end_;
};

}  // namespace tagwrench
