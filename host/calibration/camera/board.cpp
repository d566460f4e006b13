#include "host/calibration/camera/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "host/core/robust_statistics.h"
#include "host/tracker/tag_dictionary.h"

namespace tagwrench {
namespace {

constexpr std::size_t kMinCorners = 8;
constexpr std::size_t kMinMarkers = 4;
constexpr double kMarkersInPlace = 0.7;   // part of them that must lie where the board has them
constexpr double kStrangers = 0.1;        // part of the markers that may not be of this board
constexpr double kPlaceTolerance = 0.35;  // of a marker: a lens bends a board by that
constexpr double kLowContrast = 30;       // grey levels between white and black
constexpr double kDarkMean = 25;          // grey levels
constexpr double kClippedCorners = 0.5;   // part of them
constexpr double kClippedImage = 0.5;     // part of its pixels
constexpr double kTopLevel = 252;
constexpr double kBlurFraction = 0.15;  // of a square
constexpr double kMaxBlur_px = 5;
constexpr double kLowSlope = 0.1;  // part of the contrast per pixel: an edge blurred by 4 px

/// OpenCV wants a mutable pointer but does not write to its input.
cv::Mat as_mat(const ImageView& image) {
  return cv::Mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                 static_cast<std::size_t>(image.stride));
}

cv::Mat flipped_of(const cv::Mat& image) {
  cv::Mat flipped;
  cv::flip(image, flipped, 1);
  return flipped;
}

ImageView as_view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step)};
}

double percentile(const cv::Mat& values, double part) {
  std::vector<float> sorted(values.begin<float>(), values.end<float>());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(part * (sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

/// Of a grid of corners, row by row, the first of them at `from`, in squares.
std::vector<BoardCorner> on_grid(const std::vector<cv::Point2f>& found, int columns, double from) {
  std::vector<BoardCorner> rough;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int at = static_cast<int>(i);
    rough.push_back({{from + at % columns, from + at / columns}, {found[i].x, found[i].y}});
  }
  return rough;
}

/// Why there may be no board to be found.
BoardView judge(const cv::Mat& image) {
  if (cv::mean(image)[0] < kDarkMean) return BoardView::dark;
  if (cv::countNonZero(image >= kTopLevel) > kClippedImage * static_cast<double>(image.total()))
    return BoardView::saturated;
  cv::Mat smooth, dx, dy, slope;
  cv::GaussianBlur(image, smooth, {}, 1.0);
  smooth.convertTo(smooth, CV_32F);
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::magnitude(dx, dy, slope);
  const double contrast = percentile(smooth, 0.98) - percentile(smooth, 0.02);
  if (contrast > kLowContrast && percentile(slope, 0.999) < kLowSlope * contrast)
    return BoardView::blurred;
  return BoardView::no_board;
}

BoardView judge(const RefinedCorners& refined, std::size_t fewest) {
  const CornerView& look = refined.look;
  if (refined.corners.size() < fewest)
    return look.clipped_fraction > kClippedCorners ? BoardView::saturated : BoardView::part;
  if (look.contrast < kLowContrast) return BoardView::dark;
  if (look.blur_px > std::min(kMaxBlur_px, kBlurFraction * look.spacing_px))
    return BoardView::blurred;
  return BoardView::board;
}

// Of a board that was not asked for.
constexpr std::size_t kMinGuessMarkers = 6;
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
  int square = 0, left = id % columns;
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
  if (markers.ids.size() < kMinGuessMarkers) return {};
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
  std::vector<int> in_column(static_cast<std::size_t>(grid.width));
  std::vector<int> in_row(static_cast<std::size_t>(grid.height));
  for (const BoardCorner& corner :
       refine_corners(as_view(image), on_grid(found, grid.width, 0), {}).corners) {
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

const char* words(BoardView look) {
  constexpr std::array<const char*, 7> kWords = {
      "good",
      "without the board",
      "with markers that are not where this board has them",
      "with too little of the board",
      "too dark",
      "overexposed",
      "blurred"};
  return kWords[static_cast<std::size_t>(look)];
}

struct BoardFinder::Detector {
  BoardSpec spec;
  SquareFill fill;
  cv::Ptr<cv::aruco::CharucoBoard> charuco;
  cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();

  explicit Detector(const BoardSpec& board) : spec(board) {
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    if (board.kind != BoardKind::charuco) return;
    const double part = board.marker / board.square;
    fill = {true, 0.5 * (1 - part), part / (bits_per_side(board.dictionary) + 2)};
    charuco =
        cv::aruco::CharucoBoard::create(board.columns, board.rows, 1.0F, static_cast<float>(part),
                                        tag_dictionary(board.dictionary));
  }

  BoardSighting sighting(const cv::Mat& image, const std::vector<BoardCorner>& rough) const {
    const RefinedCorners refined = refine_corners(as_view(image), rough, fill);
    const auto all = static_cast<std::size_t>((spec.columns - 1) * (spec.rows - 1));
    return {judge(refined, std::min(kMinCorners, all)), refined.corners, refined.look};
  }

  std::optional<BoardSighting> checkerboard(const cv::Mat& image) const {
    const cv::Size inner(spec.columns - 1, spec.rows - 1);
    std::vector<cv::Point2f> found;
    // Each finds boards that the other misses; which of them it was does not move the corners.
    if (!cv::findChessboardCornersSB(image, inner, found,
                                     cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY) &&
        !cv::findChessboardCorners(image, inner, found,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ADAPTIVE_THRESH))
      return std::nullopt;
    return sighting(image, on_grid(found, inner.width, 1));
  }

  /// Whether the markers lie as on this board, seen from its front.
  bool in_place(const std::vector<std::vector<cv::Point2f>>& markers,
                const std::vector<int>& ids) const {
    std::vector<cv::Point2f> on_board, in_image;
    std::vector<double> sides_px;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      sides_px.push_back(cv::arcLength(markers[i], true) / 4);
      if (ids[i] < 0 || ids[i] >= static_cast<int>(charuco->objPoints.size())) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        const cv::Point3f& p = charuco->objPoints[ids[i]][c];
        on_board.emplace_back(p.x, p.y);
        in_image.push_back(markers[i][c]);
      }
    }
    const std::size_t strangers = ids.size() - on_board.size() / 4;
    if (on_board.size() < 4 * kMinMarkers ||
        static_cast<double>(strangers) > kStrangers * static_cast<double>(ids.size()))
      return false;
    const double tolerance_px = kPlaceTolerance * median(std::move(sides_px));
    std::vector<std::uint8_t> fits;
    const cv::Mat h = cv::findHomography(on_board, in_image, cv::RANSAC, tolerance_px, fits);
    if (h.empty()) return false;
    return cv::countNonZero(fits) >= kMarkersInPlace * 4 * static_cast<double>(ids.size());
  }

  std::optional<BoardSighting> charuco_board(const cv::Mat& image) const {
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> ids;
    cv::aruco::detectMarkers(image, charuco->dictionary, markers, ids, parameters);
    if (ids.size() < kMinMarkers) return std::nullopt;
    if (!in_place(markers, ids)) return BoardSighting{BoardView::other_board, {}, {}};
    std::vector<cv::Point2f> found;
    std::vector<int> corner_ids;
    cv::aruco::interpolateCornersCharuco(markers, ids, image, charuco, found, corner_ids);
    std::vector<BoardCorner> rough;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const cv::Point3f& p = charuco->chessboardCorners[corner_ids[i]];
      rough.push_back({{p.x, p.y}, {found[i].x, found[i].y}});
    }
    return sighting(image, rough);
  }

  std::optional<BoardSighting> detect(const cv::Mat& image) const {
    return spec.kind == BoardKind::charuco ? charuco_board(image) : checkerboard(image);
  }
};

BoardFinder::BoardFinder(const BoardSpec& board, bool mirrored)
    : mirrored_(mirrored),
      settled_(board.kind == BoardKind::checkerboard),
      detector_(std::make_unique<Detector>(board)) {}

BoardFinder::~BoardFinder() = default;

BoardSighting BoardFinder::find(const ImageView& image) {
  const cv::Mat delivered = as_mat(image), flipped = flipped_of(delivered);
  const auto good = [](const std::optional<BoardSighting>& s) {
    return s && s->look != BoardView::other_board;
  };
  std::optional<BoardSighting> seen = detector_->detect(mirrored_ ? flipped : delivered);
  if (!good(seen) && !settled_) {
    const std::optional<BoardSighting> other = detector_->detect(mirrored_ ? delivered : flipped);
    if (good(other)) {
      seen = other;
      mirrored_ = !mirrored_;
    }
  }
  if (!seen) return {judge(delivered), {}, {}};
  settled_ = settled_ || good(seen);
  return *seen;
}

// Which board an image shows, when it is not the one that was asked for.

std::string guess_board(const std::vector<ImageView>& images, const BoardSpec& asked) {
  std::map<std::string, int> votes;
  cv::Size plain;
  for (const ImageView& view : images) {
    const cv::Mat delivered = as_mat(view), flipped = flipped_of(delivered);
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
