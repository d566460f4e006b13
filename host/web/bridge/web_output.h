// The run's end of the pages: every sample to the live feed, a picture now and then, a recording
// where a page has begun one; and what a page requests of the loop itself. Waits for nobody.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "host/core/frame_log.h"
#include "host/output/output.h"
#include "host/output/spnav_output.h"
#include "host/source/region_source.h"
#include "host/tracker/tracker.h"
#include "host/web/bridge/board_control.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/bridge/run_control.h"
#include "host/web/server/live_feed.h"
#include "host/wrench/zero.h"

namespace tagwrench {

// The newest value of something, from one thread that must not wait to another that may.

template <typename Value>
class Latest {
 public:
  /// Leaves it out if somebody reads just now.
  void put(const Value& value) noexcept {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock) value_ = value;
  }
  Value get() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }

 private:
  mutable std::mutex mutex_;
  Value value_{};
};

/// What is seen now, besides the sample.
struct SeenNow {
  Status status = Status::acquiring;
  Diagnostic trouble = Diagnostic::none;  ///< why the target is not held
  DiagnosticDetails details;
  std::array<TagCorners, 8> corners{};
  std::uint8_t corner_count = 0;
  double residual_fraction = 0;
  ZeroState zero_state = ZeroState::off;
  std::uint64_t skipped = 0;  ///< samples that slow readers lost
};

/// Shared by the loop's thread, which puts, and the server's, which gets.
struct RunViews {
  Latest<SeenNow> seen;
  Latest<BoardReading> board;
};

class WebOutput final : public Output, public FrameLog {
 public:
  struct Parts {
    LiveFeed* feed = nullptr;
    RunControl* control = nullptr;
    RunViews* views = nullptr;
    RegionSource* source = nullptr;
    BoardControl* board = nullptr;          ///< may be null
    const SpnavOutput* programs = nullptr;  ///< likewise
    /// A line for people, and the programs that read the spnav socket by then.
    std::function<void(std::string line, std::vector<std::string> programs)> news;
  };

  /// Borrows all of them.
  explicit WebOutput(Parts parts);

  // Output
  int poll_fd() const noexcept override { return parts_.control->requests_fd(); }
  std::string_view service() noexcept override;
  bool notice(std::string_view line) noexcept override;

  // FrameLog
  void frame(const LoggedFrame& all) noexcept override;
  void missing(const Sample& sample) noexcept override;
  void disconnected(std::string_view detail) noexcept override;
  void reconnected(std::string_view detail) noexcept override;

  /// Who else is told of each frame; borrowed.
  void pass_on_to(FrameLog* next) noexcept { next_ = next; }
  /// Samples that slow readers of the run have lost; borrowed.
  void follow_skipped(const std::uint64_t& skipped) noexcept { skipped_ = &skipped; }

  // The loop's thread.
  /// Null: none any more. Borrowed.
  void record(RunRecording* recording) noexcept { recording_ = recording; }
  RegionSource& source() noexcept { return *parts_.source; }
  BoardControl* board() noexcept { return parts_.board; }

 private:
  void look(const Track& track, const Sample& sample) noexcept;

  Parts parts_;
  RunRecording* recording_ = nullptr;
  const std::uint64_t* skipped_ = nullptr;
  FrameLog* next_ = nullptr;
  SeenNow seen_;
};

}  // namespace tagwrench
