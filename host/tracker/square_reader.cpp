#include "host/tracker/square_reader.h"

#include <algorithm>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "host/tracker/tag_dictionary.h"

namespace tagwrench {
namespace {

constexpr int kCell_px = 8;          ///< of the picture that is read
constexpr int kMargin_px = 2;        ///< of a cell, not looked at
constexpr double kLeastCell_px = 4;  ///< of the square in the image
constexpr std::size_t kMostSquares = 12;
/// Of the looked-at pixels of all cells, those that may differ from most of their cell's.
constexpr double kMostImpure = 0.06;
constexpr double kLeastContrast = 30;  ///< grey levels, between black and white
constexpr double kLeastWhite = 0.1;    ///< of the cells inside the border; and of black ones

/// Families that hold all others of their size.
constexpr TagFamily kLargest[] = {
    TagFamily::aruco_original, TagFamily::aruco_4x4_1000, TagFamily::aruco_5x5_1000,
    TagFamily::aruco_6x6_1000, TagFamily::aruco_7x7_1000, TagFamily::apriltag_16h5,
    TagFamily::apriltag_25h9,  TagFamily::apriltag_36h10, TagFamily::apriltag_36h11,
    TagFamily::grid_10x10,
};
/// Those of aruco_NxN with fewer ids come right before it in TagFamily, the smallest first.
constexpr int kSmaller = 3;

using Square = std::array<Eigen::Vector2d, 4>;

double shortest_side_px(const Square& square) {
  double shortest = 1e9;
  for (std::size_t c = 0; c < 4; ++c)
    shortest = std::min(shortest, (square[(c + 1) % 4] - square[c]).norm());
  return shortest;
}

struct Bits {
  cv::Mat inside;       ///< CV_8UC1, 1 is white; empty: not a tag of this many cells
  double impurity = 1;  ///< part of the pixels that differ from their cell
};

Bits read_bits(const cv::Mat& image, const Square& square, int bits) {
  const int cells = bits + 2;
  const auto size = static_cast<float>(cells * kCell_px);
  const std::array<cv::Point2f, 4> to = {{{0, 0}, {size, 0}, {size, size}, {0, size}}};
  std::array<cv::Point2f, 4> from;
  for (std::size_t c = 0; c < 4; ++c)
    from[c] = {static_cast<float>(square[c].x()), static_cast<float>(square[c].y())};
  cv::Mat flat, ink;
  cv::warpPerspective(image, flat, cv::getPerspectiveTransform(from.data(), to.data()),
                      {cells * kCell_px, cells * kCell_px});
  cv::threshold(flat, ink, 0, 1, cv::THRESH_BINARY | cv::THRESH_OTSU);
  const double white_level = cv::mean(flat, ink)[0];
  const double black_level = cv::mean(flat, 1 - ink)[0];
  Bits read;
  if (white_level - black_level < kLeastContrast) return read;

  constexpr int kLook_px = kCell_px - 2 * kMargin_px;
  cv::Mat inside(bits, bits, CV_8UC1);
  int differing = 0, white_cells = 0;
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const int white = cv::countNonZero(
          ink({column * kCell_px + kMargin_px, row * kCell_px + kMargin_px, kLook_px, kLook_px}));
      const bool is_white = 2 * white > kLook_px * kLook_px;
      differing += is_white ? kLook_px * kLook_px - white : white;
      const bool border = row == 0 || column == 0 || row == cells - 1 || column == cells - 1;
      if (border && is_white) return read;
      if (border) continue;
      inside.at<std::uint8_t>(row - 1, column - 1) = is_white ? 1 : 0;
      white_cells += is_white ? 1 : 0;
    }
  }
  const double white_part = static_cast<double>(white_cells) / (bits * bits);
  if (white_part < kLeastWhite || white_part > 1 - kLeastWhite) return read;
  read.impurity = static_cast<double>(differing) / (cells * cells * kLook_px * kLook_px);
  if (read.impurity < kMostImpure) read.inside = inside;
  return read;
}

std::optional<int> identify(TagFamily family, const cv::Mat& bits) {
  int id = 0, rotation = 0;
  if (!tag_dictionary(family)->identify(bits, id, rotation, 0)) return std::nullopt;
  return id;
}

TagFamily smallest(TagFamily family, int id) {
  const auto last = static_cast<int>(family);
  if (last - kSmaller < static_cast<int>(TagFamily::aruco_4x4_50) ||
      family > TagFamily::aruco_7x7_1000)
    return family;
  for (int f = last - kSmaller; f < last; ++f) {
    if (id < id_count(static_cast<TagFamily>(f))) return static_cast<TagFamily>(f);
  }
  return family;
}

std::optional<ReadSquare> recognise(const cv::Mat& bits, TagFamily expected,
                                    std::span<const std::int16_t> missing) {
  if (bits_per_side(expected) == bits.rows) {
    cv::Mat flipped;
    cv::flip(bits, flipped, 1);
    const auto id = identify(expected, flipped);
    if (id && std::find(missing.begin(), missing.end(), *id) != missing.end())
      return ReadSquare{expected, *id, true};
    if (const auto as_it_is = identify(expected, bits))
      return ReadSquare{expected, *as_it_is, false};
  }
  for (const TagFamily family : kLargest) {
    if (bits_per_side(family) != bits.rows) continue;
    if (const auto id = identify(family, bits))
      return ReadSquare{smallest(family, *id), *id, false};
  }
  return std::nullopt;
}

/// Cells of the wrong size do not fill with one colour: the purest reading that is a tag counts.
std::optional<ReadSquare> read_square(const cv::Mat& image, const Square& square,
                                      TagFamily expected, std::span<const std::int16_t> missing) {
  std::optional<ReadSquare> best;
  double least = 1;
  for (const int bits : {4, 5, 6, 7, bits_per_side(TagFamily::grid_10x10)}) {
    if (shortest_side_px(square) < kLeastCell_px * (bits + 2)) continue;
    const Bits read = read_bits(image, square, bits);
    if (read.inside.empty() || read.impurity >= least) continue;
    const std::optional<ReadSquare> tag = recognise(read.inside, expected, missing);
    if (!tag) continue;
    best = tag;
    least = read.impurity;
  }
  return best;
}

}  // namespace

std::vector<ReadSquare> read_squares(const ImageView& image, const std::vector<Square>& squares,
                                     TagFamily expected, std::span<const std::int16_t> missing) {
  const cv::Mat pixels(image.height, image.width, CV_8UC1,
                       const_cast<std::uint8_t*>(image.pixels),  // only read
                       static_cast<std::size_t>(image.stride));
  std::vector<Square> largest = squares;
  const std::size_t most = std::min(largest.size(), kMostSquares);
  std::partial_sort(
      largest.begin(), largest.begin() + static_cast<std::ptrdiff_t>(most), largest.end(),
      [](const Square& a, const Square& b) { return shortest_side_px(a) > shortest_side_px(b); });
  largest.resize(most);
  std::vector<ReadSquare> tags;
  for (const Square& square : largest) {
    if (const auto tag = read_square(pixels, square, expected, missing)) tags.push_back(*tag);
  }
  return tags;
}

}  // namespace tagwrench
