#include "host/tracker/tag_dictionary.h"

#include <array>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "host/core/grid_tags.h"
#include "host/tracker/acquire.h"

namespace tagwrench {
namespace {

/// OpenCV's dictionaries in the order of TagFamily; its last, grid_10x10, is ours.
constexpr std::array<cv::aruco::PREDEFINED_DICTIONARY_NAME, kTagFamilies - 1> kPredefined = {
    cv::aruco::DICT_ARUCO_ORIGINAL, cv::aruco::DICT_4X4_50,         cv::aruco::DICT_4X4_100,
    cv::aruco::DICT_4X4_250,        cv::aruco::DICT_4X4_1000,       cv::aruco::DICT_5X5_50,
    cv::aruco::DICT_5X5_100,        cv::aruco::DICT_5X5_250,        cv::aruco::DICT_5X5_1000,
    cv::aruco::DICT_6X6_50,         cv::aruco::DICT_6X6_100,        cv::aruco::DICT_6X6_250,
    cv::aruco::DICT_6X6_1000,       cv::aruco::DICT_7X7_50,         cv::aruco::DICT_7X7_100,
    cv::aruco::DICT_7X7_250,        cv::aruco::DICT_7X7_1000,       cv::aruco::DICT_APRILTAG_16h5,
    cv::aruco::DICT_APRILTAG_25h9,  cv::aruco::DICT_APRILTAG_36h10, cv::aruco::DICT_APRILTAG_36h11,
};

cv::Ptr<cv::aruco::Dictionary> grid_dictionary() {
  cv::Mat bytes;
  for (int id = 0; id < kGridIds; ++id) {
    cv::Mat bits(kGridCells, kGridCells, CV_8UC1);
    for (int row = 0; row < kGridCells; ++row)
      for (int column = 0; column < kGridCells; ++column)
        bits.at<std::uint8_t>(row, column) = grid_is_white(id, row, column) ? 1 : 0;
    bytes.push_back(cv::aruco::Dictionary::getByteListFromBits(bits));
  }
  return cv::makePtr<cv::aruco::Dictionary>(bytes, kGridCells, (kGridDistance - 1) / 2);
}

constexpr double kUnsharpSigma_px = 1.5;
constexpr double kUnsharpAmount = 2.0;

Square square_of(const std::vector<cv::Point2f>& corners) {
  Square out;
  for (std::size_t c = 0; c < 4; ++c) out[c] = {corners[c].x, corners[c].y};
  return out;
}

}  // namespace

cv::Ptr<cv::aruco::Dictionary> tag_dictionary(TagFamily family) {
  if (family == TagFamily::grid_10x10) return grid_dictionary();
  return cv::aruco::getPredefinedDictionary(kPredefined[static_cast<std::size_t>(family)]);
}

TagPattern tag_pattern(TagFamily family, int id, double size, double border) {
  const cv::Ptr<cv::aruco::Dictionary> dictionary = tag_dictionary(family);
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
      dictionary->bytesList.rowRange(id, id + 1), dictionary->markerSize);
  cv::Mat cells;  // with its black border
  cv::copyMakeBorder(bits, cells, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  return {
      .id = id, .cells = cells.rows, .size = size, .border = border, .white = cells.reshape(1, 1)};
}

std::optional<int> identify_tag(TagFamily family, const std::vector<std::uint8_t>& white) {
  const int bits = bits_per_side(family);
  const cv::Mat cells(bits, bits, CV_8UC1, const_cast<std::uint8_t*>(white.data()));  // only read
  int id = 0, rotation = 0;
  if (!tag_dictionary(family)->identify(cells, id, rotation, 0)) return std::nullopt;
  return id;
}

struct SquareFinder::Library {
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();

  explicit Library(TagFamily family) : dictionary(tag_dictionary(family)) {
    cv::setNumThreads(1);
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    // The paper's outline lies close around the black square; the default would keep the outline
    // and drop the square.
    parameters->minMarkerDistanceRate = 0.008;
  }
};

SquareFinder::SquareFinder(TagFamily family) : library_(std::make_unique<Library>(family)) {}

SquareFinder::~SquareFinder() = default;

std::optional<SquareList> SquareFinder::find(const ImageView& image, bool sharpen) try {
  // OpenCV wants a mutable pointer but does not write to its input.
  const cv::Mat as_it_is(image.height, image.width, CV_8UC1,
                         const_cast<std::uint8_t*>(image.pixels),
                         static_cast<std::size_t>(image.stride));
  cv::Mat sharp;
  if (sharpen) {
    cv::GaussianBlur(as_it_is, sharp, {}, kUnsharpSigma_px);
    cv::addWeighted(as_it_is, 1 + kUnsharpAmount, sharp, -kUnsharpAmount, 0, sharp);
  }
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<std::vector<cv::Point2f>> rejected;
  SquareList list;
  cv::aruco::detectMarkers(sharpen ? sharp : as_it_is, library_->dictionary, corners, list.ids,
                           library_->parameters, rejected);
  for (const auto& tag : corners) list.tags.push_back(square_of(tag));
  for (const auto& other : rejected) list.others.push_back(square_of(other));
  return list;
} catch (const cv::Exception&) {
  return SquareList{};
}

}  // namespace tagwrench
