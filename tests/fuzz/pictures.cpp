// Any bytes as a picture of every format that cameras and folders give. What is called readable can
// be read, and more that is wanted leaves what was read.
#include <algorithm>
#include <array>
#include <vector>

#include "host/core/png/png.h"
#include "host/core/types.h"
#include "host/source/decode.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;

constexpr int kWidth = 64;
constexpr int kHeight = 48;

unsigned sum_of(const Frame& frame) {
  const Region part = frame.readable();
  expect((Region{0, 0, frame.image.width, frame.image.height}).contains(part), "it is within");
  unsigned sum = 0;
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int x = part.x; x < part.x + part.width; ++x)
      sum = 31 * sum + frame.image.pixels[static_cast<std::ptrdiff_t>(y) * frame.image.stride + x];
  }
  return sum;
}

void decode(const RawFrame& raw, int width, int height) {
  RawDecoder decoder(width, height);
  const Region part{8, 8, std::min(24, width - 8), std::min(16, height - 8)};
  Frame frame;
  if (!decoder.decode(raw, part, frame)) return;
  expect(frame.image.width == width && frame.image.height == height, "it has the size asked for");
  sum_of(frame);
  if (!decoder.decode(raw, {}, frame)) return;
  const unsigned first = sum_of(frame);
  Frame again;
  if (decoder.decode(raw, {}, again)) expect(sum_of(again) == first, "twice the same");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  if (count < 2) return 0;
  constexpr std::array kFormats = {fourcc("MJPG"), fourcc("PNG "), fourcc("PGM "), fourcc("GREY"),
                                   fourcc("NV12"), fourcc("YUYV"), fourcc("UYVY")};
  const std::uint32_t format = kFormats[bytes[0] % kFormats.size()];
  const int stride = bytes[1] < 128 ? 0 : bytes[1] - 128;
  // Of its own length, so that the sanitizer sees a byte too many.
  const std::vector<std::uint8_t> own(bytes + 2, bytes + count);
  decode({format, own, stride}, kWidth, kHeight);
  const std::optional<ImageSize> size = image_size(own);
  if (size && size->width <= 256 && size->height <= 256 && size->width > 8 && size->height > 8)
    decode({format, own, stride}, size->width, size->height);
  std::vector<std::uint16_t> counts;
  if (decode_png(own, kWidth, kHeight, counts))
    expect(counts.size() == std::size_t{kWidth} * kHeight, "each pixel has its counts");
  return 0;
}
