#include "host/source/simulator/image_file.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace tagwrench::sim {
namespace {

constexpr int kDefaultJpegQuality = 95;
constexpr int kFastPng = 1;

}  // namespace

const char* extension(FileFormat format) {
  switch (format) {
    case FileFormat::png:
      return ".png";
    case FileFormat::pgm:
      return ".pgm";
    case FileFormat::jpeg:
      return ".jpg";
  }
  return "";
}

std::vector<std::uint8_t> encode_image(const std::uint8_t* pixels, int width, int height,
                                       FileFormat format, int jpeg_quality) {
  // OpenCV takes no const data; imencode only reads it.
  const cv::Mat image(height, width, CV_8UC1, const_cast<std::uint8_t*>(pixels));
  std::vector<int> options;
  if (format == FileFormat::png) options = {cv::IMWRITE_PNG_COMPRESSION, kFastPng};
  if (format == FileFormat::jpeg) {
    options = {cv::IMWRITE_JPEG_QUALITY, jpeg_quality > 0 ? jpeg_quality : kDefaultJpegQuality};
  }
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(extension(format), image, bytes, options)) {
    throw std::runtime_error(
        "simulated sensor: OpenCV cannot write pictures: reinstall libopencv-imgcodecs");
  }
  return bytes;
}

JpegRoundTrip::JpegRoundTrip(int width, int height, int quality) : width_(width), height_(height) {
  if (quality > 0) options_ = {cv::IMWRITE_JPEG_QUALITY, quality};
}

void JpegRoundTrip::apply(std::uint8_t* pixels) noexcept {
  if (options_.empty()) return;
  try {
    cv::Mat image(height_, width_, CV_8UC1, pixels);
    cv::imencode(".jpg", image, encoded_, options_);
    cv::imdecode(encoded_, cv::IMREAD_GRAYSCALE, &image);
  } catch (const std::exception&) {
    // Out of memory: the picture stays as it was.
  }
}

}  // namespace tagwrench::sim
