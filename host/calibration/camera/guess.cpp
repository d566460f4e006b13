// Which board an image shows, when it is not the one that was asked for.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "host/calibration/camera/board.h"
#include "host/tracker/tag_dictionary.h"

namespace tagwrench {
namespace {

constexpr std::size_t kMinMarkers = 6;
constexpr int kMaxColumns = 40;
constexpr double kInPlace = 0.9;     // part of the markers
constexpr double kTolerance = 0.25;  // of a marker's side

struct Markers {
  TagFamily family{};
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
};

/// With the dictionary that reads most of them; the first of several, so the smallest that holds
/// them.
Markers read_markers(const cv::Mat& image) {
  Markers best;
  for (int family = 0; family < kTagFamilies; ++family) {
    Markers now;
    now.family = static_cast<TagFamily>(family);
    cv::aruco::detectMarkers(image, tag_dictionary(now.family), now.corners, now.ids);
    if (now.ids.size() > best.ids.size()) best = now;
  }
  return best;
}

/// Centre of a marker on a board of so many columns, in squares: the white squares in reading
/// order.
cv::Point2f place(int id, int columns) {
  const int pair = 2 * columns;  // squares of two rows hold `columns` markers
  const int rows = id / columns * 2;
  int square = 0;
  int left = id % columns;
  for (; square < pair; ++square) {
    const bool white = (square / columns + square % columns) % 2 == 1;
    if (white && left-- == 0) break;
  }
  return {static_cast<float>(square % columns) + 0.5F,
          static_cast<float>(rows + square / columns) + 0.5F};
}

/// Columns of the board on which these markers lie as they do; 0 if none.
int columns_of(const Markers& markers) {
  std::vector<cv::Point2f> centres;
  double side_px = 0;
  for (const auto& corners : markers.corners) {
    centres.push_back(0.25F * (corners[0] + corners[1] + corners[2] + corners[3]));
    side_px += cv::arcLength(corners, true) / 4 / static_cast<double>(markers.corners.size());
  }
  int best = 0;
  int most = static_cast<int>(kInPlace * static_cast<double>(centres.size()));
  for (int columns = 3; columns <= kMaxColumns; ++columns) {
    std::vector<cv::Point2f> places;
    for (const int id : markers.ids) places.push_back(place(id, columns));
    std::vector<std::uint8_t> fits;
    const cv::Mat h = cv::findHomography(places, centres, cv::RANSAC, kTolerance * side_px, fits);
    if (h.empty() || cv::determinant(h) <= 0) continue;
    const int count = cv::countNonZero(fits);
    if (count > most) {
      most = count;
      best = columns;
    }
  }
  return best;
}

std::string charuco_words(int columns, int rows, std::string_view dictionary) {
  return fmt::format("charuco:{}x{} with {} markers", columns, rows, dictionary);
}

std::string guess_charuco(const cv::Mat& image) {
  const Markers markers = read_markers(image);
  if (markers.ids.size() < kMinMarkers) return {};
  const int columns = columns_of(markers);
  const std::string_view dictionary = name(markers.family);
  if (columns == 0) return fmt::format("a charuco board with {} markers", dictionary);
  const int highest = *std::max_element(markers.ids.begin(), markers.ids.end());
  int rows = 1;
  while (columns * rows / 2 <= highest) ++rows;
  return charuco_words(columns, rows, dictionary);
}

/// Without the outer lines of a grid of corners that the edge of the paper made, not squares.
cv::Size without_false_edges(const cv::Mat& image, const std::vector<cv::Point2f>& found,
                             const cv::Size& grid) {
  std::vector<BoardCorner> rough;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int at = static_cast<int>(i);
    rough.push_back({{at % grid.width, at / grid.width}, {found[i].x, found[i].y}});
  }
  const ImageView view{image.data, image.cols, image.rows, static_cast<int>(image.step)};
  std::vector<int> in_column(static_cast<std::size_t>(grid.width));
  std::vector<int> in_row(static_cast<std::size_t>(grid.height));
  for (const BoardCorner& corner : refine_corners(view, rough, {}).corners) {
    ++in_column[static_cast<std::size_t>(corner.board.x())];
    ++in_row[static_cast<std::size_t>(corner.board.y())];
  }
  cv::Size left = grid;
  for (const std::size_t end : {std::size_t{0}, in_column.size() - 1})
    left.width -= 2 * in_column[end] < grid.height ? 1 : 0;
  for (const std::size_t end : {std::size_t{0}, in_row.size() - 1})
    left.height -= 2 * in_row[end] < grid.width ? 1 : 0;
  return left;
}

/// Squares of the checkerboard, the longer side first; 0 x 0 where there is none.
cv::Size checkerboard_of(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(image, {3, 3}, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, meta))
    return {};
  const cv::Size inner = without_false_edges(image, corners, {meta.cols, meta.rows});
  const auto [shorter, longer] = std::minmax({inner.width + 1, inner.height + 1});
  return {longer, shorter};
}

}  // namespace

std::string guess_board(const std::vector<ImageView>& images, const BoardSpec& asked) {
  std::map<std::string, int> votes;
  cv::Size plain;
  for (const ImageView& view : images) {
    const cv::Mat delivered(view.height, view.width, CV_8UC1,
                            const_cast<std::uint8_t*>(view.pixels),
                            static_cast<std::size_t>(view.stride));
    cv::Mat flipped;
    cv::flip(delivered, flipped, 1);
    std::string guess = guess_charuco(delivered);
    if (guess.empty()) guess = guess_charuco(flipped);
    if (!guess.empty()) ++votes[guess];
    if (!votes.empty()) continue;
    // A board that is seen in part looks smaller, never larger.
    if (const cv::Size squares = checkerboard_of(delivered); squares.area() > plain.area())
      plain = squares;
  }
  const auto winner = std::max_element(
      votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (winner != votes.end()) {
    const bool same =
        asked.kind == BoardKind::charuco &&
        winner->first == charuco_words(asked.columns, asked.rows, name(asked.dictionary));
    return same ? std::string() : winner->first;
  }
  const auto [shorter, longer] = std::minmax({asked.columns, asked.rows});
  const bool same = asked.kind == BoardKind::checkerboard && plain == cv::Size(longer, shorter);
  if (plain.empty() || same) return {};
  return fmt::format("checkerboard:{}x{}", plain.width, plain.height);
}

}  // namespace tagwrench
