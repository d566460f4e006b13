// A source around another one that delivers no more than was asked for: then a recording that keeps
// only this replays to the same result.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "host/source/frame_source.h"

namespace tagwrench {

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
