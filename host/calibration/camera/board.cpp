#include "host/calibration/camera/board.h"

#include <algorithm>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

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

ImageView as_view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step)};
}

double percentile(const cv::Mat& values, double part) {
  std::vector<float> sorted(values.begin<float>(), values.end<float>());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(part * (sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

/// Why there may be no board to be found.
BoardView judge(const cv::Mat& image) {
  if (cv::mean(image)[0] < kDarkMean) return BoardView::dark;
  if (cv::countNonZero(image >= kTopLevel) > kClippedImage * static_cast<double>(image.total()))
    return BoardView::saturated;
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {}, 1.0);
  smooth.convertTo(smooth, CV_32F);
  cv::Mat dx;
  cv::Mat dy;
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::Mat slope;
  cv::magnitude(dx, dy, slope);
  const double contrast = percentile(smooth, 0.98) - percentile(smooth, 0.02);
  if (contrast > kLowContrast && percentile(slope, 0.999) < kLowSlope * contrast)
    return BoardView::blurred;
  return BoardView::no_board;
}

BoardView judge(const RefinedCorners& refined, std::size_t fewest) {
  const CornerView& look = refined.look;
  if (refined.corners.size() < fewest) return BoardView::part;
  if (look.contrast < kLowContrast) return BoardView::dark;
  if (look.clipped_fraction > kClippedCorners) return BoardView::saturated;
  if (look.blur_px > std::min(kMaxBlur_px, kBlurFraction * look.spacing_px))
    return BoardView::blurred;
  return BoardView::board;
}

cv::Ptr<cv::aruco::DetectorParameters> marker_parameters() {
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  return parameters;
}

}  // namespace

const char* words(BoardView look) {
  switch (look) {
    case BoardView::board:
      return "good";
    case BoardView::no_board:
      return "without the board";
    case BoardView::other_board:
      return "with markers that are not where this board has them";
    case BoardView::part:
      return "with too little of the board";
    case BoardView::dark:
      return "too dark";
    case BoardView::saturated:
      return "overexposed";
    case BoardView::blurred:
      return "blurred";
  }
  return "?";
}

struct BoardFinder::Detector {
  BoardSpec spec;
  SquareFill fill;
  cv::Ptr<cv::aruco::CharucoBoard> charuco;
  cv::Ptr<cv::aruco::DetectorParameters> parameters = marker_parameters();

  explicit Detector(const BoardSpec& board) : spec(board) {
    if (board.kind != BoardKind::charuco) return;
    const double part = board.marker / board.square;
    fill = {true, 0.5 * (1 - part), part / (bits_per_side(board.dictionary) + 2)};
    charuco =
        cv::aruco::CharucoBoard::create(board.columns, board.rows, 1.0F, static_cast<float>(part),
                                        tag_dictionary(board.dictionary));
  }

  std::size_t corners_on_board() const {
    return static_cast<std::size_t>(spec.columns - 1) * static_cast<std::size_t>(spec.rows - 1);
  }
  std::size_t fewest() const { return std::min(kMinCorners, corners_on_board()); }

  BoardSighting sighting(const cv::Mat& image, const std::vector<BoardCorner>& rough) const {
    const RefinedCorners refined = refine_corners(as_view(image), rough, fill);
    BoardSighting out;
    out.look = judge(refined, fewest());
    out.corners = refined.corners;
    out.corner_view = refined.look;
    return out;
  }

  std::optional<BoardSighting> checkerboard(const cv::Mat& image) const {
    const cv::Size inner(spec.columns - 1, spec.rows - 1);
    std::vector<cv::Point2f> found;
    if (!cv::findChessboardCornersSB(image, inner, found,
                                     cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY))
      return std::nullopt;
    std::vector<BoardCorner> rough;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const int at = static_cast<int>(i);
      rough.push_back({{1.0 + at % inner.width, 1.0 + at / inner.width}, {found[i].x, found[i].y}});
    }
    return sighting(image, rough);
  }

  /// Whether the markers lie as on this board, seen from its front.
  bool in_place(const std::vector<std::vector<cv::Point2f>>& markers,
                const std::vector<int>& ids) const {
    std::vector<cv::Point2f> on_board;
    std::vector<cv::Point2f> in_image;
    std::vector<float> sides_px;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      sides_px.push_back(static_cast<float>(cv::arcLength(markers[i], true) / 4));
      if (ids[i] < 0 || ids[i] >= static_cast<int>(charuco->objPoints.size())) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        const cv::Point3f& p = charuco->objPoints[static_cast<std::size_t>(ids[i])][c];
        on_board.emplace_back(p.x, p.y);
        in_image.push_back(markers[i][c]);
      }
    }
    const std::size_t strangers = ids.size() - on_board.size() / 4;
    if (on_board.size() < 4 * kMinMarkers ||
        static_cast<double>(strangers) > kStrangers * static_cast<double>(ids.size()))
      return false;
    std::nth_element(sides_px.begin(),
                     sides_px.begin() + static_cast<std::ptrdiff_t>(sides_px.size() / 2),
                     sides_px.end());
    const double tolerance_px = kPlaceTolerance * sides_px[sides_px.size() / 2];
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
      const cv::Point3f& p = charuco->chessboardCorners[static_cast<std::size_t>(corner_ids[i])];
      rough.push_back({{p.x, p.y}, {found[i].x, found[i].y}});
    }
    return sighting(image, rough);
  }

  std::optional<BoardSighting> detect(const cv::Mat& image) const {
    return spec.kind == BoardKind::charuco ? charuco_board(image) : checkerboard(image);
  }
};

BoardFinder::BoardFinder(const BoardSpec& board, bool mirrored)
    : board_(board), mirrored_(mirrored), detector_(std::make_unique<Detector>(board)) {
  settled_ = board.kind == BoardKind::checkerboard;
}

BoardFinder::~BoardFinder() = default;

BoardSighting BoardFinder::find(const ImageView& image) {
  const cv::Mat delivered = as_mat(image);
  cv::Mat flipped;
  cv::flip(delivered, flipped, 1);
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

}  // namespace tagwrench
