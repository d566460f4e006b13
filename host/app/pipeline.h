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
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/frame_log.h"
#include "host/core/sleep_watch.h"
#include "host/core/types.h"
#include "host/motion/profile_manager.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"
#include "host/source/frame_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

// When the next frame is missing, and what is neutral then: the loop by itself, and should the loop
// hang, the watchdog. Times are passed in.

class FrameWatch {
 public:
  /// `period`: that the source announces. The watchdog is borrowed.
  FrameWatch(Watchdog& watchdog, Duration period) noexcept;

  void begin(TimePoint now) noexcept { last_arrival_ = now; }
  /// The median of three intervals counts: one hiccup does not delay the next neutral, a camera
  /// that slows down is believed.
  void frame_came(TimePoint now, Duration period) noexcept;
  /// When the frame after the last one is so late that it is missing.
  TimePoint missing_at() const noexcept;

  /// From here on the watchdog sends neutral, should the loop hang.
  void arm() noexcept;
  /// All is neutral.
  void stand_down() noexcept { watchdog_.stand_down(); }

 private:
  Watchdog& watchdog_;
  TimePoint last_arrival_{};
  std::array<Duration, 3> intervals_;  ///< the last three between frames
  Duration interval_;                  ///< to be expected, at least the announced period
};

// When input devices move: with every sample, or, where a profile asks for a steady rate, at that
// rate between frames too. Times are passed in.

class OutputScheduler {
 public:
  enum class Move : std::uint8_t {
    none,         ///< the clock's turn comes later
    with_sample,  ///< to what the sample says
    on            ///< to where the motion is by now
  };

  /// A sample was made. `period` of the moves; zero: they have none. Without numbers devices move
  /// at once, to neutral, and rest.
  Move sample(bool numbers, Duration period, TimePoint now) noexcept;

  /// Whether devices are to move on. The next time is one period later, and not earlier than now:
  /// what a loop has slept through is not made up for.
  bool due(TimePoint now, Duration period) noexcept {
    if (now < next_) return false;
    next_ = now - next_ > period ? now + period : next_ + period;
    return true;
  }

  /// When due() is asked next; never, while devices move with samples alone.
  TimePoint next() const noexcept { return next_; }

 private:
  TimePoint next_ = TimePoint::max();
};

// What a run says to people, to outputs that show it, else to the log; diagnostics once each.

class StatusLines {
 public:
  /// Borrowed.
  explicit StatusLines(std::span<Output* const> outputs) noexcept : outputs_(outputs) {}

  /// An empty line is none.
  void say(std::string_view line) noexcept;
  /// Why the target is not held. What was wrong is taken away once it is held.
  void say_diagnostic(const Track& track) noexcept;

  /// The last line that said why the target is not held.
  const std::string& trouble() const noexcept { return trouble_; }

 private:
  std::span<Output* const> outputs_;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool trouble_shown_ = false;  ///< since the target was last held
  std::string trouble_;
};

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

  /// Runs until a limit, the source's end, a stop or a failed output; does not throw for these.
  RunReport run(const RunLimits& limits) noexcept;
  /// While it runs, for its own thread.
  const RunReport& so_far() const noexcept { return report_; }

 private:
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
