#include "host/config/appearance_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "host/config/sensor_edit.h"
#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr float kCountsPerLevel = 256.0F;
constexpr const char* kRemedy =
    "remove rest.appearance, and run `tagwrench calibrate target` for a new one";

// Of a PNG file (W3C, "Portable Network Graphics Specification", 5.2 and 11.2.2).
constexpr std::array<unsigned char, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kHeaderSize = 26;
constexpr std::size_t kWidthAt = 16;
constexpr std::size_t kHeightAt = 20;
constexpr std::size_t kDepthAt = 24;
constexpr std::size_t kColourTypeAt = 25;
constexpr unsigned char kGrey = 0;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
  throw ConfigError(fmt::format("{}: {}; {}", path.string(), what, kRemedy));
}

std::uint32_t big_endian(const std::vector<unsigned char>& bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
         std::uint32_t{bytes[at + 2]} << 8 | std::uint32_t{bytes[at + 3]};
}

/// The header is checked before anything is decoded: a small file may claim gigapixels.
void check_header(const std::filesystem::path& path, const std::vector<unsigned char>& bytes,
                  const CameraModel& camera) {
  if (bytes.size() < kHeaderSize ||
      !std::equal(kSignature.begin(), kSignature.end(), bytes.begin())) {
    refuse(path, "is not a PNG file");
  }
  const std::uint32_t width = big_endian(bytes, kWidthAt);
  const std::uint32_t height = big_endian(bytes, kHeightAt);
  if (width != static_cast<std::uint32_t>(camera.width_px) ||
      height != static_cast<std::uint32_t>(camera.height_px)) {
    refuse(path, fmt::format("is {}x{}, but sensor.yaml's camera is {}x{}", width, height,
                             camera.width_px, camera.height_px));
  }
  if (bytes[kDepthAt] != 16 || bytes[kColourTypeAt] != kGrey) {
    refuse(path, fmt::format("is a {}-bit {} picture, but the rest image is 16-bit grey",
                             bytes[kDepthAt], bytes[kColourTypeAt] == kGrey ? "grey" : "colour"));
  }
}

}  // namespace

RestImage load_rest_image(const std::filesystem::path& path, const CameraModel& camera) {
  std::error_code error;  // a pipe or a device may never end
  std::ifstream in;
  if (std::filesystem::is_regular_file(path, error)) in.open(path, std::ios::binary);
  if (!in.is_open()) refuse(path, "cannot be read as a file");
  std::vector<unsigned char> bytes(std::istreambuf_iterator<char>(in), {});
  check_header(path, bytes, camera);
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.type() != CV_16UC1 || picture.cols != camera.width_px ||
      picture.rows != camera.height_px) {
    refuse(path, "is damaged");
  }
  RestImage image;
  image.width = picture.cols;
  image.height = picture.rows;
  image.level.reserve(picture.total());
  for (int row = 0; row < picture.rows; ++row) {
    const auto* counts = picture.ptr<std::uint16_t>(row);
    for (int column = 0; column < picture.cols; ++column)
      image.level.push_back(static_cast<float>(counts[column]) / kCountsPerLevel);
  }
  return image;
}

void save_rest_image(const std::filesystem::path& path, const RestImage& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.level.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw std::invalid_argument("rest image: size and levels do not agree");
  }
  cv::Mat picture(image.height, image.width, CV_16UC1);
  std::transform(image.level.begin(), image.level.end(), picture.ptr<std::uint16_t>(),
                 [](float level) {
                   return static_cast<std::uint16_t>(
                       std::clamp(std::round(level * kCountsPerLevel), 0.0F, 65535.0F));
                 });
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace tagwrench
