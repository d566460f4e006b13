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
#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/output/spnav_output.h"
#include "host/source/frame_source.h"
#include "host/tracker/tracker.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/server/live_feed.h"
#include "host/wrench/zero.h"

namespace tagwrench {

class WebOutput;

// The board beside a run, as far as a page may touch it. In the loop's thread.

struct BoardReading {
  struct Cell {
    bool known = false;  ///< calibrated, and it has spoken
    double newtons = 0;
    double sigma_n = 0;
  };
  double led = 0;          ///< 0..1
  double exposure_us = 0;  ///< 0: not known
  std::array<Cell, 4> cells{};
};

class BoardControl {
 public:
  BoardControl() = default;
  BoardControl(const BoardControl&) = delete;
  BoardControl& operator=(const BoardControl&) = delete;
  virtual ~BoardControl() = default;

  virtual BoardReading reading() const noexcept = 0;
  /// 0..1, what the LED may have for ever at most.
  virtual void set_led(double level) noexcept = 0;
  /// The level that was found when the light was set.
  virtual void set_led_as_settled() noexcept = 0;
  /// From now on this cell reads nothing, until the run ends. False: it is not calibrated.
  virtual bool tare(std::size_t channel) noexcept = 0;
};

/// An event that is counted; throws ConfigError if the system has no more descriptors.
UniqueFd make_event();
void raise_event(const UniqueFd& event) noexcept;
void clear_event(const UniqueFd& event) noexcept;

// Between the server's thread and the loop of a run: requests that must happen in the loop, and the
// request that it give the camera away.

class RunControl {
 public:
  /// In the loop's thread; or in that of close(), with nothing, when the run is over.
  using Request = std::function<void(WebOutput*)>;

  /// `stop` becomes readable when a signal has come. Throws ConfigError if the system has no more
  /// descriptors.
  explicit RunControl(int stop);

  /// Readable once a signal has come or the camera is wanted: the run shall end.
  int end_fd() const noexcept { return end_.get(); }
  /// Readable when run_requests() has something to do.
  int requests_fd() const noexcept { return requests_ready_.get(); }

  // Any thread.
  void request(Request request);
  /// Of the run that there is, or else of the next one.
  void want_camera() noexcept { raise_event(camera_wanted_); }
  /// That request is fulfilled.
  void camera_given() noexcept { clear_event(camera_wanted_); }

  // The loop's thread, and that which builds runs.
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
  }
  void run_requests(WebOutput& output) noexcept;
  void close() noexcept;

 private:
  std::vector<Request> take() noexcept {
    const std::lock_guard lock(mutex_);
    return std::exchange(requests_, {});
  }

  UniqueFd camera_wanted_;
  UniqueFd requests_ready_;
  UniqueFd end_;
  std::mutex mutex_;
  bool open_ = false;
  std::vector<Request> requests_;
};

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
    std::function<void(std::string line, std::vector<std::string> programs)> news{};
  };

  /// Borrows all of them.
  explicit WebOutput(Parts parts) : parts_(std::move(parts)) {}

  // Output
  int poll_fd() const noexcept override { return parts_.control->requests_fd(); }
  std::string_view service() noexcept override {
    parts_.control->run_requests(*this);
    return {};
  }
  bool notice(std::string_view line) noexcept override;

  // FrameLog
  void frame(const LoggedFrame& all) noexcept override;
  void missing(const Sample& sample) noexcept override;
  void disconnected(std::string_view detail) noexcept override {
    if (recording_ != nullptr) recording_->disconnected(detail);
    if (next_ != nullptr) next_->disconnected(detail);
  }
  void reconnected(std::string_view detail) noexcept override {
    if (recording_ != nullptr) recording_->reconnected(detail);
    if (next_ != nullptr) next_->reconnected(detail);
  }

  /// Who else is told of each frame; borrowed.
  void pass_on_to(FrameLog* next) noexcept { next_ = next; }
  /// Samples that slow readers of the run have lost; borrowed.
  void follow_skipped(const std::uint64_t& skipped) noexcept { skipped_ = &skipped; }

  // The loop's thread.
  /// Null: none any more. Borrowed. `narrow`: the part around the tags alone.
  void record(RunRecording* recording, bool narrow) noexcept {
    parts_.source->narrow(narrow);
    recording_ = recording;
  }
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
