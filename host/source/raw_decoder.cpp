#include "host/source/raw_decoder.h"

#include <exception>
#include <optional>
#include <vector>

#include "host/core/png/png.h"
#include "host/source/decode.h"
#include "host/source/image_header.h"
#include "host/source/pgm.h"

namespace tagwrench {

struct RawDecoder::State {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;  ///< of a PNG or PGM
  std::optional<Decoder> decoder;  ///< of everything else
  std::uint32_t decodes = 0;       ///< its format
  int stride = 0;

  bool decode_file(const RawFrame& raw, Frame& frame) {
    // Asked first, so that a damaged file cannot make a decoder allocate without bound.
    if (image_size(raw.bytes) != ImageSize{width, height}) return false;
    if (!(raw.fourcc == fourcc("PGM ") ? decode_pgm(raw.bytes, width, height, grey)
                                       : decode_png(raw.bytes, width, height, grey))) {
      return false;
    }
    frame.image = {grey.data(), width, height, width};
    frame.decoded = {};
    return true;
  }

  bool decode_camera(const RawFrame& raw, const Region& wanted, Frame& frame) {
    if (!decoder || decodes != raw.fourcc || stride != raw.stride) {
      const std::optional<PixelFormat> format = pixel_format(raw.fourcc);
      if (!format) return false;
      decoder.emplace(*format, width, height, raw.stride);
      decodes = raw.fourcc;
      stride = raw.stride;
    }
    return decoder->decode(raw.bytes, raw.bytes.size(), wanted, frame.image, frame.decoded);
  }
};

RawDecoder::RawDecoder(int width, int height) : state_(std::make_unique<State>()) {
  state_->width = width;
  state_->height = height;
}

RawDecoder::~RawDecoder() = default;

bool RawDecoder::decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept {
  try {
    const bool file = raw.fourcc == fourcc("PNG ") || raw.fourcc == fourcc("PGM ");
    return file ? state_->decode_file(raw, frame) : state_->decode_camera(raw, wanted, frame);
  } catch (const std::exception&) {
    return false;  // out of memory
  }
}

}  // namespace tagwrench
