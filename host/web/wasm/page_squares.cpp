// The page's like of square_finder.cpp.
#include <algorithm>
#include <string>

#include "host/tracker/square_finder.h"
#include "host/web/wasm/page.h"

namespace tagwrench {
namespace {

std::vector<Square> squares_of(const float (*corners)[8], int count) {
  std::vector<Square> out(static_cast<std::size_t>(count));
  for (Square& square : out) {
    for (std::size_t c = 0; c < 4; ++c) square[c] = {(*corners)[2 * c], (*corners)[2 * c + 1]};
    ++corners;
  }
  return out;
}

}  // namespace

struct SquareFinder::Library {
  std::string family;
  std::vector<std::uint8_t> packed;  ///< the image without padding
  PageSquares squares;
};

SquareFinder::SquareFinder(TagFamily family) : library_(std::make_unique<Library>()) {
  library_->family = name(family);
}

SquareFinder::~SquareFinder() = default;

std::optional<SquareList> SquareFinder::find(const ImageView& image, bool sharpen) {
  const auto width = static_cast<std::size_t>(image.width);
  library_->packed.resize(width * static_cast<std::size_t>(image.height));
  for (int row = 0; row < image.height; ++row) {
    const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    std::copy(from, from + width,
              library_->packed.begin() + static_cast<std::ptrdiff_t>(row) * image.width);
  }
  PageSquares& found = library_->squares;
  const PageLook look = page_find_squares(library_->packed.data(), image.width, image.height,
                                          library_->family.c_str(), sharpen, found);
  if (look == PageLook::no_finder) return std::nullopt;
  if (look == PageLook::refused) return SquareList{};
  return SquareList{{found.id, found.id + found.tags},
                    squares_of(found.tag_corners, found.tags),
                    squares_of(found.other_corners, found.others)};
}

}  // namespace tagwrench
