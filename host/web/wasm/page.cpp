#include "host/web/wasm/page.h"

#include <emscripten.h>

// `Module.page` is the object that core.ts hands in when it loads the core.
// clang-format off
EM_JS(void, tagwrench_page_sha256, (const std::uint8_t* bytes, std::size_t count, std::uint8_t* digest), {
  HEAPU8.set(Module['page'].sha256(HEAPU8.subarray(bytes, bytes + count)), digest);
});
EM_JS(int, tagwrench_page_decode_png, (const std::uint8_t* bytes, std::size_t count, int width, int height, std::uint16_t* grey), {
  const counts = Module['page'].decodePng(HEAPU8.subarray(bytes, bytes + count), width, height);
  if (!counts || counts.length !== width * height) return 0;
  HEAPU16.set(counts, grey >> 1);
  return 1;
});
EM_JS(int, tagwrench_page_find_squares, (const std::uint8_t* pixels, int width, int height, const char* family, int sharpen, int most,
                                         std::int32_t* counts, std::int32_t* ids, float* tags, float* others), {
  const finder = Module['page'].finder;
  if (!finder) return 1;
  let found;
  try {
    found = finder.find(HEAPU8.subarray(pixels, pixels + width * height), width, height, UTF8ToString(family), !!sharpen);
  } catch (error) {
    return 2;
  }
  const tagCount = Math.min(found.ids.length, most);
  const otherCount = Math.min(found.others.length / 8, most);
  HEAP32.set(found.ids.subarray(0, tagCount), ids >> 2);
  HEAPF32.set(found.tags.subarray(0, 8 * tagCount), tags >> 2);
  HEAPF32.set(found.others.subarray(0, 8 * otherCount), others >> 2);
  HEAP32[counts >> 2] = tagCount;
  HEAP32[(counts >> 2) + 1] = otherCount;
  return 0;
});
// clang-format on

namespace tagwrench {

void page_sha256(const std::uint8_t* bytes, std::size_t count, std::uint8_t* digest) {
  tagwrench_page_sha256(bytes, count, digest);
}

bool page_decode_png(const std::uint8_t* bytes, std::size_t count, int width, int height,
                     std::uint16_t* grey) {
  return tagwrench_page_decode_png(bytes, count, width, height, grey) != 0;
}

PageLook page_find_squares(const std::uint8_t* pixels, int width, int height, const char* family,
                           bool sharpen, PageSquares& squares) {
  std::int32_t counts[2] = {0, 0};
  const int look = tagwrench_page_find_squares(
      pixels, width, height, family, sharpen ? 1 : 0, kMaxPageSquares, counts, squares.id,
      &squares.tag_corners[0][0], &squares.other_corners[0][0]);
  squares.tags = counts[0];
  squares.others = counts[1];
  return static_cast<PageLook>(look);
}

}  // namespace tagwrench
