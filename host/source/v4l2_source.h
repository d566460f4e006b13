// A live camera. The newest frame wins, whatever is automatic is locked, and a camera that goes
// away is waited for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/source/frame_source.h"
#include "host/source/v4l2_device.h"
#include "host/source/v4l2_settings.h"

namespace tagwrench {

// The bookkeeping of a capture queue: sequence numbers, clocks, losses, staleness. Pure: time and
// stamps are passed in.

class CaptureQueueTracker {
 public:
  /// `period` between frames decides what is stale.
  explicit CaptureQueueTracker(Duration period) : period_(period) {}

  /// The stream has started (again): the next buffer may be a left-over, and its number begins a
  /// new count.
  void stream_started() noexcept {
    stream_is_new_ = true;
    have_driver_sequence_ = false;
  }
  /// The next frame noted has number 0 and nothing was lost before it.
  void number_from_zero() noexcept {
    from_zero_ = true;
    taken_.reset();
  }

  /// Every buffer that was dequeued, in order. False: the first of a stream, discard it (drivers
  /// hand out an old picture there). `prompt`: it was waited for, so a driver clock that is far
  /// behind is a wrong clock.
  bool note(const BufferStamp& stamp, bool prompt) noexcept;

  /// Of the frame noted last.
  std::uint64_t sequence() const noexcept { return sequence_; }
  /// Of the frame noted last; strictly increasing. The driver's stamp while it is trusted, else
  /// when it was dequeued.
  TimePoint capture_time() const noexcept { return capture_time_; }

  /// Whether the frame noted last is too old to act on. `queue_was_full`: the driver had no buffer
  /// left to fill, so without its clock the age is only known to be less than the time since
  /// `last_drain`.
  bool stale(TimePoint now, TimePoint last_drain, bool queue_was_full) const noexcept;

  /// The frame noted last is handed on: how many were captured since the one handed on before it.
  std::uint32_t take() noexcept;

  /// False once stamps were not monotonic, lay in the future or were absurd; never becomes true
  /// again.
  bool trusts_driver_clock() const noexcept { return trusts_driver_clock_; }
  /// max(2 periods, 100 ms): a frame older than this is never handed on.
  Duration stale_after() const noexcept {
    return std::max<Duration>(2 * period_, std::chrono::milliseconds(100));
  }

 private:
  Duration period_;
  std::uint64_t sequence_ = 0;
  std::uint32_t driver_sequence_ = 0;
  bool stream_is_new_ = true;
  bool have_driver_sequence_ = false;
  bool from_zero_ = true;
  bool trusts_driver_clock_ = true;
  TimePoint capture_time_{};
  std::optional<std::uint64_t> taken_;
};

class V4l2Source final : public FrameSource, private CameraLight {
 public:
  /// Opens the camera, chooses the mode, and streams for up to 20 frames or 1.5 s so that automatic
  /// exposure settles and the driver's clock shows what it is worth; then locks the controls.
  /// Throws ConfigError.
  explicit V4l2Source(const V4l2Options& options);
  /// Stops the stream and puts every control back as it was.
  ~V4l2Source() override;

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return epoll_.get(); }
  /// While the camera is away this tries to open it twice a second, which may take the driver some
  /// milliseconds.
  ReadStatus read(Frame& frame) noexcept override;
  void want(const Region& region) noexcept override { wanted_ = region; }
  bool complete(Frame& frame) noexcept override;
  RawFrame raw() const noexcept override;
  std::string detail() const override { return detail_; }
  std::string unusable() const override;
  /// Nothing where the exposure could not be locked.
  CameraLight* camera_light() noexcept override;
  bool change_setting(std::uint32_t id, std::int64_t value) noexcept override;

 private:
  Range exposure_range_us() const noexcept override;
  double exposure_us() const noexcept override;
  bool set_exposure_us(double exposure_us) noexcept override;
  Range gain_range() const noexcept override;
  double gain() const noexcept override;
  bool set_gain(double gain) noexcept override;
  Range range_of(std::uint32_t control, double unit, double most) const noexcept;
  bool set_control(std::uint32_t control, double value) noexcept;

  enum class State : std::uint8_t {
    streaming,
    away,     ///< closed; tried again at every tick
    waiting,  ///< open again, no frame yet
  };

  void settle(int exposure_us);
  void watch(int fd) const;
  void watch_camera();
  ReadStatus drain(unsigned queued, Frame& frame) noexcept;
  ReadStatus deliver(const V4l2Buffer& newest, bool queue_was_full, Frame& frame) noexcept;
  ReadStatus lose(const char* why) noexcept;
  ReadStatus retry() noexcept;
  Duration stall_after() const noexcept {
    return std::max<Duration>(5 * format_.period, std::chrono::milliseconds(500));
  }

  V4l2Choice choice_;
  std::string path_;         ///< as the user named it
  std::string stable_path_;  ///< where it is looked for when it was away
  SourceFormat format_;
  UniqueFd epoll_;
  UniqueFd timer_;
  std::unique_ptr<V4l2Device> device_;
  std::optional<Decoder> decoder_;
  CaptureQueueTracker capture_queue_;
  ControlLock controls_;
  std::optional<V4l2Buffer> held_;  ///< of the last Frame, until the next read()
  int stride_ = 0;                  ///< of its rows in bytes, 0 for mjpg
  Region wanted_;
  State state_ = State::streaming;
  TimePoint last_buffer_{};
  TimePoint last_drain_{};
  /// Skipped since the start; every such frame is also in Frame::dropped of the next good one.
  std::uint64_t corrupt_ = 0, stale_ = 0;
  std::string detail_;
};

}  // namespace tagwrench
