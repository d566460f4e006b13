#include "host/core/png/png.h"

#include <spng.h>
#include <zlib.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

namespace tagwrench {
namespace {

struct Free {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
  void operator()(void* bytes) const { std::free(bytes); }
};
using Context = std::unique_ptr<spng_ctx, Free>;

constexpr std::size_t kMaxMetadata = 64U << 20;  // bytes; a small file may unpack to anything

/// Empty where the bytes are no PNG.
Context open(std::span<const std::uint8_t> bytes, spng_ihdr& header) {
  Context context(spng_ctx_new(0));
  const bool good = context &&
                    spng_set_chunk_limits(context.get(), kMaxMetadata, kMaxMetadata) == 0 &&
                    spng_set_png_buffer(context.get(), bytes.data(), bytes.size()) == 0 &&
                    spng_get_ihdr(context.get(), &header) == 0;
  return good ? std::move(context) : nullptr;
}

bool has_size(const spng_ihdr& header, int width, int height) {
  return width > 0 && height > 0 && header.width == static_cast<std::uint32_t>(width) &&
         header.height == static_cast<std::uint32_t>(height);
}

std::size_t pixels_of(const spng_ihdr& header) {
  return static_cast<std::size_t>(header.width) * header.height;
}

template <typename Sample>
bool decode(spng_ctx* context, spng_format format, std::vector<Sample>& samples) {
  // The chunks behind the picture too, so that a file without its end is found out.
  return spng_decode_image(context, samples.data(), samples.size() * sizeof(Sample), format, 0) ==
             0 &&
         spng_decode_chunks(context) == 0;
}

bool decode_counts(spng_ctx* context, const spng_ihdr& header, std::vector<std::uint16_t>& counts) {
  counts.resize(pixels_of(header));
  return decode(context, SPNG_FMT_PNG, counts);
}

bool decode_luminance(spng_ctx* context, const spng_ihdr& header, std::vector<std::uint8_t>& grey) {
  std::vector<std::uint8_t> rgb(3 * pixels_of(header));
  if (!decode(context, SPNG_FMT_RGB8, rgb)) return false;
  grey.resize(pixels_of(header));
  for (std::size_t i = 0; i < grey.size(); ++i) {
    // .299, .587 and .114 in 1/65536
    const std::uint32_t sum =
        19595U * rgb[3 * i] + 38470U * rgb[3 * i + 1] + 7471U * rgb[3 * i + 2];
    grey[i] = static_cast<std::uint8_t>((sum + 32768U) >> 16);
  }
  return true;
}

void must(int error) {
  if (error != 0) throw std::runtime_error(std::string("PNG: ") + spng_strerror(error));
}

std::vector<std::uint8_t> encode(const void* grey, int width, int height, int bit_depth) {
  const Context context(spng_ctx_new(SPNG_CTX_ENCODER));
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
  const std::unique_ptr<void, Free> bytes(spng_get_png_buffer(context.get(), &packed, &error));
  must(error);
  const auto* first = static_cast<const std::uint8_t*>(bytes.get());
  return {first, first + packed};
}

}  // namespace

std::optional<PngHeader> png_header(std::span<const std::uint8_t> bytes) noexcept {
  spng_ihdr header{};
  if (!open(bytes, header)) return std::nullopt;
  return PngHeader{header.width, header.height, header.bit_depth,
                   header.color_type == SPNG_COLOR_TYPE_GRAYSCALE};
}

bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey) {
  spng_ihdr header{};
  const Context context = open(bytes, header);
  if (!context || !has_size(header, width, height)) return false;
  if (header.color_type != SPNG_COLOR_TYPE_GRAYSCALE)
    return decode_luminance(context.get(), header, grey);
  grey.resize(pixels_of(header));
  if (header.bit_depth <= 8) return decode(context.get(), SPNG_FMT_G8, grey);
  std::vector<std::uint16_t> counts;
  if (!decode_counts(context.get(), header, counts)) return false;
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = static_cast<std::uint8_t>(counts[i] >> 8);
  return true;
}

bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint16_t>& grey) {
  spng_ihdr header{};
  const Context context = open(bytes, header);
  return context && has_size(header, width, height) && header.bit_depth == 16 &&
         header.color_type == SPNG_COLOR_TYPE_GRAYSCALE &&
         decode_counts(context.get(), header, grey);
}

std::vector<std::uint8_t> encode_png(const std::uint8_t* grey, int width, int height) {
  return encode(grey, width, height, 8);
}

std::vector<std::uint8_t> encode_png(const std::uint16_t* grey, int width, int height) {
  return encode(grey, width, height, 16);
}

}  // namespace tagwrench
