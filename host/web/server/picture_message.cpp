#include "host/web/server/picture_message.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/json/json_text.h"
#include "host/source/raw_decoder.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr std::uint8_t kUnknownGrey = 128;

struct JpegEnd {
  void operator()(unsigned char* bytes) const noexcept { tjFree(bytes); }
};

/// One pixel is the mean of `factor` by `factor`.
void shrink(const ImageView& image, int factor, std::vector<std::uint8_t>& out, int width,
            int height) {
  out.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<unsigned> sums(static_cast<std::size_t>(width));
  const auto area = static_cast<unsigned>(factor * factor);
  for (int row = 0; row < height; ++row) {
    std::fill(sums.begin(), sums.end(), area / 2);
    for (int part = 0; part < factor; ++part) {
      const std::uint8_t* pixel =
          image.pixels + static_cast<std::ptrdiff_t>(row * factor + part) * image.stride;
      for (unsigned& sum : sums)
        for (int column = 0; column < factor; ++column) sum += *pixel++;
    }
    std::uint8_t* target = out.data() + static_cast<std::ptrdiff_t>(row) * width;
    for (const unsigned sum : sums) *target++ = static_cast<std::uint8_t>(sum / area);
  }
}

json header_of(const LivePicture& picture) {
  json tags = json::array();
  for (std::size_t i = 0; i < picture.tag_count; ++i) {
    json corners = json::array();
    for (const double px : picture.tags[i].px) corners.push_back(std::round(px * 10) / 10);
    tags.push_back({{"id", picture.tags[i].id}, {"px", std::move(corners)}});
  }
  return {{"seq", picture.sequence},
          {"t_ns", Duration(picture.capture_time.time_since_epoch()).count()},
          {"width", picture.width},
          {"height", picture.height},
          {"tags", std::move(tags)},
          {"status", name(picture.status)}};
}

}  // namespace

struct PictureMaker::State {
  struct CompressorEnd {
    void operator()(void* handle) const noexcept { tjDestroy(handle); }
  };
  std::unique_ptr<void, CompressorEnd> compressor{tjInitCompress()};
  std::unique_ptr<RawDecoder> decoder;
  int width = 0;  ///< of what the decoder decodes
  int height = 0;
  std::vector<std::uint8_t> whole;
  std::vector<std::uint8_t> small;
};

PictureMaker::PictureMaker() : state_(std::make_unique<State>()) {}
PictureMaker::~PictureMaker() = default;

std::optional<ImageView> PictureMaker::decode(const LivePicture& picture) {
  const int width = picture.width;
  const int height = picture.height;
  if (picture.part.empty()) {
    if (!state_->decoder || state_->width != width || state_->height != height)
      state_->decoder = std::make_unique<RawDecoder>(width, height);
    state_->width = width;
    state_->height = height;
    Frame frame;
    const RawFrame raw{picture.fourcc, {picture.bytes.get(), picture.size}, picture.stride};
    if (!state_->decoder->decode(raw, {}, frame)) return {};
    return frame.image;
  }
  const Region& part = picture.part;
  state_->whole.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                       kUnknownGrey);
  for (int row = 0; row < part.height; ++row) {
    const auto* from = picture.bytes.get() + static_cast<std::ptrdiff_t>(row) * picture.stride;
    std::copy_n(from, part.width,
                state_->whole.data() + static_cast<std::ptrdiff_t>(part.y + row) * width + part.x);
  }
  return ImageView{state_->whole.data(), width, height, width};
}

std::shared_ptr<const std::vector<std::uint8_t>> PictureMaker::message(const LivePicture& picture,
                                                                       const ImageView& whole) {
  const int factor = (whole.width + kWidest - 1) / kWidest;
  ImageView shown = whole;
  if (factor > 1) {
    const int width = whole.width / factor;
    const int height = whole.height / factor;
    shrink(whole, factor, state_->small, width, height);
    shown = {state_->small.data(), width, height, width};
  }
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      tjCompress2(state_->compressor.get(), shown.pixels, shown.width, shown.stride, shown.height,
                  TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, kQuality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, JpegEnd> jpeg(bytes);
  if (failed != 0) return nullptr;
  return picture_message(header_of(picture), {jpeg.get(), size});
}

std::shared_ptr<const std::vector<std::uint8_t>> picture_message(
    const json& header, std::span<const std::uint8_t> jpeg) {
  const std::string text = dump_json(header);
  std::vector<std::uint8_t> message;
  message.reserve(4 + text.size() + jpeg.size());
  for (int shift = 0; shift < 32; shift += 8)
    message.push_back(static_cast<std::uint8_t>(text.size() >> shift & 0xffU));
  message.insert(message.end(), text.begin(), text.end());
  message.insert(message.end(), jpeg.begin(), jpeg.end());
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(message));
}

}  // namespace tagwrench
