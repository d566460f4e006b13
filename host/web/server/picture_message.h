// A picture for pages: a header in JSON, and a small JPEG.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <vector>

#include "host/core/types.h"
#include "host/web/server/live_feed.h"

namespace tagwrench {

/// The header's length (4 bytes, little-endian), the header, the JPEG.
std::shared_ptr<const std::vector<std::uint8_t>> picture_message(
    const nlohmann::json& header, std::span<const std::uint8_t> jpeg);

/// Makes pictures of the feed what pages show. Keeps its buffers.
class PictureMaker {
 public:
  static constexpr int kWidest = 640;
  static constexpr int kQuality = 70;

  PictureMaker();
  ~PictureMaker();

  /// All of the picture, grey where it is not known; valid until the next call. Nothing: the bytes
  /// are damaged.
  std::optional<ImageView> decode(const LivePicture& picture);
  /// Of the whole picture, made smaller if it is wider than kWidest; its coordinates in the header
  /// are the whole picture's. Null: it cannot be compressed.
  std::shared_ptr<const std::vector<std::uint8_t>> message(const LivePicture& picture,
                                                           const ImageView& whole);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tagwrench
