// Room source: frames of cameras, folders, recordings and the simulator.
// In:  what `--source` names; the region that the tracker wants to see.
// Out: Frame: grey pixels, lent until the next read(), and their time (CLOCK_MONOTONIC).
// Axes: the picture as delivered, px: x right, y down, pixel centres at whole numbers.
// Then: v4l2_source.h, replay.h, decode.h, simulator/scenario.h.
//
// Where frames come from. A camera, a folder, a recording and the simulator are equals behind this
// interface.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "host/core/types.h"

namespace tagwrench {

enum class SourceKind : std::uint8_t { simulator, camera, images, recording };

/// How long and with what gain a camera exposes, where that can be set while it streams.
class CameraLight {
 public:
  /// Equal ends where it cannot be set.
  struct Range {
    double least = 0;
    double most = 0;
  };
  CameraLight() = default;
  CameraLight(const CameraLight&) = delete;
  CameraLight& operator=(const CameraLight&) = delete;
  virtual ~CameraLight() = default;
  /// What the camera exposes with at least and at most without lowering its frame rate, us.
  virtual Range exposure_range_us() const noexcept = 0;
  virtual double exposure_us() const noexcept = 0;
  /// Sets the nearest exposure that the camera has; of one of the next pictures on. False: refused.
  virtual bool set_exposure_us(double exposure_us) noexcept = 0;
  /// In the camera's own units: more is brighter, not always in proportion.
  virtual Range gain_range() const noexcept = 0;
  virtual double gain() const noexcept = 0;
  virtual bool set_gain(double gain) noexcept = 0;
};

struct SourceFormat {
  int width = 0;
  int height = 0;
  Duration period{};        ///< between frames, as the source announces it
  std::string description;  ///< one line for people: device, mode, rate, pixel format
};

enum class ReadStatus : std::uint8_t {
  frame,         ///< the Frame argument is filled
  nothing,       ///< woken for nothing (a corrupt or stale frame was skipped); poll again
  disconnected,  ///< the device went away or stalled; detail() says so. Reported once; keep
                 ///< polling
  reconnected,   ///< it is back; detail() says so
  missing,       ///< a recording says that here no frame had come in time; of the Frame argument
                 ///< only recorded_latency is filled
  end,           ///< no more frames will come
};

/// Setup (the constructors of implementations) throws ConfigError; the running loop gets
/// statuses.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Fixed for the source's lifetime, reconnections included.
  virtual const SourceFormat& format() const noexcept = 0;

  /// Readable when read() is worth calling; -1 when it always is (a source that runs as fast as
  /// it can). May change after any read(), so ask again before every poll.
  virtual int poll_fd() const noexcept = 0;

  /// Takes the newest frame, never a stale one. Never blocks, never throws. The frame is valid
  /// until the next read().
  virtual ReadStatus read(Frame& frame) noexcept = 0;

  /// From the next read() on only this part of the image will be looked at (empty: all), so that
  /// no more than this needs to be decoded. A source may deliver more: Frame::decoded says.
  virtual void want(const Region& /*region*/) noexcept {}

  /// Decodes the rest of the frame that the last read() delivered, in place. False: the rest is
  /// damaged, and the frame is as it was.
  virtual bool complete(Frame& /*frame*/) noexcept { return true; }

  /// The frame that the last read() delivered, as it was before it was decoded; no bytes where
  /// the source has none. Valid until the next read().
  virtual RawFrame raw() const noexcept { return {}; }

  /// Exposure and gain, where the source has them; owned by it. Valid for its lifetime.
  virtual CameraLight* camera_light() noexcept { return nullptr; }

  /// Another value for a setting of the camera (a V4L2_CID_ number) that this source keeps fixed.
  /// False: it does not, or the camera refuses.
  virtual bool change_setting(std::uint32_t /*id*/, std::int64_t /*value*/) noexcept {
    return false;
  }

  /// One line about the frames that were delivered but could not be used; empty if there were
  /// none.
  virtual std::string unusable() const { return {}; }
  /// What the source reads is not as it was written: numbers that come of it are not all there.
  virtual bool damaged() const { return false; }

  /// One line about the last disconnected or reconnected status.
  virtual std::string detail() const { return {}; }
};

/// Around another source, delivers no more than was asked for: then a recording that keeps only
/// this replays to the same result.
class RegionSource final : public FrameSource {
 public:
  /// `narrow`: from the start; see narrow().
  explicit RegionSource(std::unique_ptr<FrameSource> inner, bool narrow = true)
      : inner_(std::move(inner)), narrow_(narrow) {}

  /// Whether it delivers no more than was asked for, or all that the inner one does.
  void narrow(bool on) noexcept { narrow_ = on; }

  const SourceFormat& format() const noexcept override { return inner_->format(); }
  int poll_fd() const noexcept override { return inner_->poll_fd(); }
  CameraLight* camera_light() noexcept override { return inner_->camera_light(); }
  std::string unusable() const override { return inner_->unusable(); }
  bool damaged() const override { return inner_->damaged(); }
  std::string detail() const override { return inner_->detail(); }
  bool change_setting(std::uint32_t id, std::int64_t value) noexcept override {
    return inner_->change_setting(id, value);
  }
  RawFrame raw() const noexcept override { return inner_->raw(); }

  ReadStatus read(Frame& frame) noexcept override {
    const ReadStatus status = inner_->read(frame);
    if (status == ReadStatus::frame) {
      shown_ = frame.readable();
      if (narrow_)
        frame.decoded = common(shown_, wanted_.clipped(frame.image.width, frame.image.height));
    }
    return status;
  }
  void want(const Region& region) noexcept override {
    wanted_ = region;
    inner_->want(region);
  }
  bool complete(Frame& frame) noexcept override {
    const Region part = std::exchange(frame.decoded, shown_);
    if (inner_->complete(frame)) return true;
    frame.decoded = part;
    return false;
  }

 private:
  /// All of `shown` where the two have nothing in common.
  static Region common(const Region& shown, const Region& wanted) noexcept {
    const int left = std::max(shown.x, wanted.x);
    const int top = std::max(shown.y, wanted.y);
    const Region both{left, top, std::min(shown.x + shown.width, wanted.x + wanted.width) - left,
                      std::min(shown.y + shown.height, wanted.y + wanted.height) - top};
    return both.empty() ? shown : both;
  }

  std::unique_ptr<FrameSource> inner_;
  bool narrow_;
  Region wanted_;
  Region shown_;  ///< of the last frame, by the inner source
};

}  // namespace tagwrench
