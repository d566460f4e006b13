// Proves that nobody reads pixels that were not asked for: a source around another one that
// delivers only what was wanted, and full-contrast noise, new for every frame, everywhere else.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/source/frame_source.h"

namespace tagwrench::test {

class PoisonedSource final : public FrameSource {
 public:
  struct Delivery {
    Region decoded;          ///< as delivered by read()
    bool completed = false;  ///< the rest was asked for
  };

  /// `inner` delivers whole frames; it is borrowed.
  explicit PoisonedSource(FrameSource& inner) : inner_(inner) {}

  const SourceFormat& format() const noexcept override { return inner_.format(); }
  int poll_fd() const noexcept override { return inner_.poll_fd(); }
  std::string detail() const override { return inner_.detail(); }
  std::string unusable() const override { return inner_.unusable(); }

  ReadStatus read(Frame& frame) noexcept override {
    const ReadStatus status = inner_.read(frame);
    if (status != ReadStatus::frame) return status;
    truth_ = frame.image;
    pixels_.resize(static_cast<std::size_t>(truth_.width) *
                   static_cast<std::size_t>(truth_.height));
    std::generate(pixels_.begin(), pixels_.end(), [this] {
      noise_ = noise_ * 1664525U + 1013904223U;  // Numerical Recipes' quick generator
      return static_cast<std::uint8_t>(noise_ >> 24);
    });
    reveal(wanted_.clipped(truth_.width, truth_.height), frame);
    deliveries_.push_back({frame.decoded, false});
    return status;
  }
  void want(const Region& region) noexcept override { wanted_ = region; }
  bool complete(Frame& frame) noexcept override {
    deliveries_.back().completed = true;
    if (rest_is_damaged) return false;
    reveal({0, 0, truth_.width, truth_.height}, frame);
    return true;
  }

  /// One for each frame so far.
  const std::vector<Delivery>& deliveries() const noexcept { return deliveries_; }

  bool rest_is_damaged = false;  ///< then no frame can be completed

 private:
  void reveal(const Region& region, Frame& frame) noexcept {
    for (int y = region.y; y < region.y + region.height; ++y) {
      std::copy_n(truth_.pixels + static_cast<std::ptrdiff_t>(y) * truth_.stride + region.x,
                  region.width,
                  pixels_.begin() + static_cast<std::ptrdiff_t>(y) * truth_.width + region.x);
    }
    frame.image = {pixels_.data(), truth_.width, truth_.height, truth_.width};
    frame.decoded = region;
  }

  FrameSource& inner_;
  Region wanted_;
  ImageView truth_;
  std::vector<std::uint8_t> pixels_;
  std::uint32_t noise_ = 1;
  std::vector<Delivery> deliveries_;
};

}  // namespace tagwrench::test
