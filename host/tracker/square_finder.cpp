#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "host/tracker/squares.h"
#include "host/tracker/tag_dictionary.h"

namespace tagwrench {
namespace {

constexpr double kUnsharpSigma_px = 1.5;
constexpr double kUnsharpAmount = 2.0;

Square square_of(const std::vector<cv::Point2f>& corners) {
  Square out;
  for (std::size_t c = 0; c < 4; ++c) out[c] = {corners[c].x, corners[c].y};
  return out;
}

}  // namespace

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
