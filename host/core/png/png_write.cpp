#include "host/core/png/png_write.h"

#include <spng.h>
#include <zlib.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

namespace tagwrench {
namespace {

struct EndOfEncoder {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
  void operator()(void* bytes) const { std::free(bytes); }
};

void must(int error) {
  if (error != 0) throw std::runtime_error(std::string("PNG: ") + spng_strerror(error));
}

std::vector<std::uint8_t> encode(const void* grey, int width, int height, int bit_depth) {
  const std::unique_ptr<spng_ctx, EndOfEncoder> context(spng_ctx_new(SPNG_CTX_ENCODER));
  if (!context) throw std::runtime_error("PNG: out of memory");
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = static_cast<std::uint8_t>(bit_depth);
  header.color_type = SPNG_COLOR_TYPE_GRAYSCALE;
  must(spng_set_ihdr(context.get(), &header));
  // Noise of a camera packs no better for more work.
  must(spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, 1));
  must(spng_set_option(context.get(), SPNG_IMG_COMPRESSION_STRATEGY, Z_RLE));
  must(spng_set_option(context.get(), SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB));
  must(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1));
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(bit_depth / 8);
  must(spng_encode_image(context.get(), grey, size, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t packed = 0;
  int error = 0;
  const std::unique_ptr<void, EndOfEncoder> bytes(
      spng_get_png_buffer(context.get(), &packed, &error));
  must(error);
  const auto* first = static_cast<const std::uint8_t*>(bytes.get());
  return {first, first + packed};
}

}  // namespace

std::vector<std::uint8_t> encode_png(const std::uint8_t* grey, int width, int height) {
  return encode(grey, width, height, 8);
}

std::vector<std::uint8_t> encode_png(const std::uint16_t* grey, int width, int height) {
  return encode(grey, width, height, 16);
}

}  // namespace tagwrench
