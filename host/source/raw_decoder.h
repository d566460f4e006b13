// Frames as they came, of whatever format, to luminance: what replays a folder or a recording. The
// bytes come from files and are not trusted.
#pragma once

#include <memory>

#include "host/core/types.h"

namespace tagwrench {

class RawDecoder {
 public:
  RawDecoder(int width, int height);
  ~RawDecoder();
  RawDecoder(const RawDecoder&) = delete;
  RawDecoder& operator=(const RawDecoder&) = delete;

  /// Fills `image` and `decoded` of the frame, at least the `wanted` part (empty: all); the pixels
  /// are the very ones that the source of `raw` delivered. PNG and PGM are decoded whole. `raw`
  /// must outlive the frame, which is valid until the next call. Decoding the same bytes again with
  /// more wanted leaves what was readable as it was. False: unknown format, damaged, or of another
  /// size.
  bool decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept;

 private:
  struct State;  ///< keeps the picture libraries out of this header
  std::unique_ptr<State> state_;
};

}  // namespace tagwrench
