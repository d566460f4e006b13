#include "host/sensor/appearance_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/png/png.h"

namespace tagwrench {
namespace {

constexpr const char* kRemedy =
    "remove rest.appearance, and run `tagwrench calibrate target` for a new one";

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
  throw ConfigError(fmt::format("{}: {}; {}", path.string(), what, kRemedy));
}

/// The header is checked before anything is decoded: a small file may claim gigapixels.
void check_header(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes,
                  const CameraModel& camera) {
  const auto header = png_header(bytes);
  if (!header) refuse(path, "is not a PNG file");
  if (header->width != static_cast<std::uint32_t>(camera.width_px) ||
      header->height != static_cast<std::uint32_t>(camera.height_px)) {
    refuse(path, fmt::format("is {}x{}, but sensor.yaml's camera is {}x{}", header->width,
                             header->height, camera.width_px, camera.height_px));
  }
  if (header->bit_depth != 16 || !header->grey) {
    refuse(path, fmt::format("is a {}-bit {} picture, but the rest image is 16-bit grey",
                             header->bit_depth, header->grey ? "grey" : "colour"));
  }
}

}  // namespace

ReferenceImage load_reference_image(const std::filesystem::path& path, const CameraModel& camera) {
  std::error_code error;  // a pipe or a device may never end
  std::ifstream in;
  if (std::filesystem::is_regular_file(path, error)) in.open(path, std::ios::binary);
  if (!in.is_open()) refuse(path, "cannot be read as a file");
  std::vector<std::uint8_t> bytes(std::istreambuf_iterator<char>(in), {});
  check_header(path, bytes, camera);
  std::vector<std::uint16_t> counts;
  if (!decode_png(bytes, camera.width_px, camera.height_px, counts)) refuse(path, "is damaged");
  ReferenceImage image;
  image.width = camera.width_px;
  image.height = camera.height_px;
  image.level.reserve(counts.size());
  for (const std::uint16_t count : counts)
    image.level.push_back(static_cast<float>(count) / kReferenceCountsPerLevel);
  return image;
}

}  // namespace tagwrench
