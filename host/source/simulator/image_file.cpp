#include "host/source/simulator/image_file.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <stdexcept>
#include <string>

#include "host/core/png/png_write.h"

namespace tagwrench::sim {
namespace {

constexpr int kDefaultJpegQuality = 95;

/// Room for the largest grey JPEG of this size.
std::vector<std::uint8_t> room_for_jpeg(int width, int height) {
  const unsigned long size = tjBufSize(width, height, TJSAMP_GRAY);
  if (size == static_cast<unsigned long>(-1))
    throw std::runtime_error(fmt::format("JPEG: no picture is {}x{}", width, height));
  return std::vector<std::uint8_t>(size);
}

/// Bytes of it that are the file; 0: it could not be made.
unsigned long encode_jpeg(tjhandle encoder, const std::uint8_t* pixels, int width, int height,
                          int quality, std::vector<std::uint8_t>& room) noexcept {
  unsigned char* to = room.data();
  unsigned long size = room.size();
  const int failed = tjCompress2(encoder, pixels, width, width, height, TJPF_GRAY, &to, &size,
                                 TJSAMP_GRAY, quality, TJFLAG_ACCURATEDCT | TJFLAG_NOREALLOC);
  return failed != 0 ? 0 : size;
}

std::vector<std::uint8_t> jpeg_file(const std::uint8_t* pixels, int width, int height,
                                    int quality) {
  std::vector<std::uint8_t> file = room_for_jpeg(width, height);
  const std::unique_ptr<void, int (*)(void*)> encoder(tjInitCompress(), tjDestroy);
  file.resize(encode_jpeg(encoder.get(), pixels, width, height, quality, file));
  if (file.empty()) throw std::runtime_error(std::string("JPEG: ") + tjGetErrorStr2(encoder.get()));
  return file;
}

std::vector<std::uint8_t> pgm_file(const std::uint8_t* pixels, int width, int height) {
  const std::string header = fmt::format("P5\n{} {}\n255\n", width, height);
  std::vector<std::uint8_t> file(header.begin(), header.end());
  file.insert(file.end(), pixels,
              pixels + static_cast<std::ptrdiff_t>(width) * static_cast<std::ptrdiff_t>(height));
  return file;
}

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
  switch (format) {
    case FileFormat::png:
      return encode_png(pixels, width, height);
    case FileFormat::pgm:
      return pgm_file(pixels, width, height);
    case FileFormat::jpeg:
      return jpeg_file(pixels, width, height,
                       jpeg_quality > 0 ? jpeg_quality : kDefaultJpegQuality);
  }
  return {};
}

JpegRoundTrip::JpegRoundTrip(int width, int height, int quality)
    : width_(width),
      height_(height),
      quality_(quality),
      encoder_(quality > 0 ? tjInitCompress() : nullptr, tjDestroy),
      decoder_(quality > 0 ? tjInitDecompress() : nullptr, tjDestroy) {
  if (quality <= 0) return;
  if (!encoder_ || !decoder_) throw std::runtime_error("JPEG: out of memory");
  encoded_ = room_for_jpeg(width, height);
}

void JpegRoundTrip::apply(std::uint8_t* pixels) noexcept {
  if (quality_ <= 0) return;
  const unsigned long size =
      encode_jpeg(encoder_.get(), pixels, width_, height_, quality_, encoded_);
  // Out of memory: the picture stays as it was.
  if (size == 0) return;
  tjDecompress2(decoder_.get(), encoded_.data(), size, pixels, width_, width_, height_, TJPF_GRAY,
                TJFLAG_ACCURATEDCT);
}

}  // namespace tagwrench::sim
