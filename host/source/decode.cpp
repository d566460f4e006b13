#include "host/source/decode.h"

#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <optional>
#include <type_traits>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/png/png.h"

namespace tagwrench {
namespace {

/// Surplus bytes before the end marker that are a camera's habit and not damage.
constexpr int kMaxPadding = 64;
/// A progressive JPEG may repeat its scans without end; real ones have about ten.
constexpr int kMaxScans = 500;

/// What libjpeg's callbacks need.
struct Caller {
  std::jmp_buf escape;
  std::int64_t markers_passed = 0;  ///< restart markers that libjpeg does not get to see
};

Caller& caller_of(j_common_ptr jpeg) { return *static_cast<Caller*>(jpeg->client_data); }
j_common_ptr common(jpeg_decompress_struct& jpeg) { return reinterpret_cast<j_common_ptr>(&jpeg); }

/// libjpeg's functions leave through here: on an error, and on the first sign of damage.
[[noreturn]] void leave(j_common_ptr jpeg) { std::longjmp(caller_of(jpeg).escape, 1); }

/// The picture is whole and only padding follows it: some webcams do so in every frame.
bool is_padding(const jpeg_error_mgr& error) {
  constexpr int kEndOfImage = 0xD9;
  return error.msg_code == JWRN_EXTRANEOUS_DATA && error.msg_parm.i[0] <= kMaxPadding &&
         error.msg_parm.i[1] == kEndOfImage;
}

void judge_message(j_common_ptr jpeg, int level) {
  const bool damage = level < 0 && !is_padding(*jpeg->err);
  // libjpeg found the restart marker that it expects, but the true number is another.
  const bool misled = jpeg->err->msg_code == JTRC_RST && caller_of(jpeg).markers_passed % 8 != 0;
  if (damage || misled) leave(jpeg);
}

void limit_scans(j_common_ptr jpeg) {
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > kMaxScans) leave(jpeg);
}

/// A restart marker with another number than `expected`: right if the markers passed explain it.
boolean judge_restart(j_decompress_ptr jpeg, int expected) {
  constexpr int kRestart0 = 0xD0;
  const std::int64_t number = (expected + caller_of(common(*jpeg)).markers_passed) % 8;
  if (jpeg->unread_marker != kRestart0 + number) leave(common(*jpeg));
  jpeg->unread_marker = 0;
  return TRUE;
}

/// Runs `step`, which calls libjpeg; false if it left through leave(). longjmp runs no destructors,
/// so neither `step` nor anything that it calls may own anything.
template <typename Step>
bool ends_well(Caller& caller, Step step) {
  static_assert(std::is_trivially_destructible_v<Step>);
  if (setjmp(caller.escape) != 0) return false;
  return step();
}

/// Whether the components that luminance is made of are stored at full resolution. Else libjpeg
/// would interpolate them, across the edges of a region too.
bool luminance_is_finest(const jpeg_decompress_struct& jpeg) {
  const int needed = jpeg.jpeg_color_space == JCS_RGB ? 3 : 1;
  for (int i = 0; i < needed; ++i) {
    const jpeg_component_info& component = jpeg.comp_info[i];
    if (component.h_samp_factor != jpeg.max_h_samp_factor ||
        component.v_samp_factor != jpeg.max_v_samp_factor)
      return false;
  }
  return true;
}

constexpr std::array<std::string_view, 5> kNames = {"GREY", "NV12", "YUYV", "UYVY", "MJPG"};
std::uint32_t code(std::string_view text) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(text[i]);
  return value;
}

void take_every_second_byte(const std::uint8_t* __restrict from, std::uint8_t* __restrict to,
                            int count) {
  for (int x = 0; x < count; ++x) to[x] = from[2 * x];
}

constexpr std::uint32_t kMaxSide = 16384;

std::optional<ImageSize> checked(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) return std::nullopt;
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

bool is_frame_header(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

std::optional<ImageSize> jpeg_size(std::span<const std::uint8_t> bytes) {
  std::size_t at = 2;
  while (at + 4 <= bytes.size()) {
    if (bytes[at] != 0xFF) return std::nullopt;
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xFF) {
      ++at;  // fill byte
      continue;
    }
    const std::uint32_t length = big_endian(bytes.subspan(at + 2, 2));
    if (length < 2) return std::nullopt;
    if (is_frame_header(marker)) {
      // marker, length, precision, height, width
      if (at + 9 > bytes.size()) return std::nullopt;
      return checked(big_endian(bytes.subspan(at + 7, 2)), big_endian(bytes.subspan(at + 5, 2)));
    }
    at += 2 + length;
  }
  return std::nullopt;
}

constexpr std::uint32_t kMaxCounts = 65535;

bool is_space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Behind white space and comments; `at` is left behind its last digit. Empty where there is none,
/// or a larger one than any that a PGM may hold.
std::optional<std::uint32_t> number(std::span<const std::uint8_t> bytes, std::size_t& at) {
  while (at < bytes.size() && (is_space(bytes[at]) || bytes[at] == '#')) {
    if (bytes[at] == '#')
      while (at < bytes.size() && bytes[at] != '\n') ++at;
    else
      ++at;
  }
  std::optional<std::uint32_t> value;
  for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at) {
    value = value.value_or(0) * 10 + (bytes[at] - '0');
    if (*value > kMaxCounts) return std::nullopt;
  }
  return value;
}

std::uint8_t level(std::uint32_t count, std::uint32_t white) {
  return static_cast<std::uint8_t>((std::min(count, white) * 255 + white / 2) / white);
}

bool decode_plain(std::span<const std::uint8_t> text, std::uint32_t white,
                  std::vector<std::uint8_t>& grey) {
  std::size_t at = 0;
  for (std::uint8_t& pixel : grey) {
    const auto count = number(text, at);
    if (!count) return false;
    pixel = level(*count, white);
  }
  return true;
}

bool decode_binary(std::span<const std::uint8_t> data, std::uint32_t white,
                   std::vector<std::uint8_t>& grey) {
  const bool wide = white > 255;
  if (white == 255 && data.size() >= grey.size()) {
    std::copy_n(data.begin(), grey.size(), grey.begin());
    return true;
  }
  if (data.size() / (wide ? 2 : 1) < grey.size()) return false;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const std::uint32_t count =
        wide ? std::uint32_t{data[2 * i]} << 8 | data[2 * i + 1] : std::uint32_t{data[i]};
    grey[i] = level(count, white);
  }
  return true;
}

}  // namespace

struct JpegLuma::State {
  Caller caller;
  jpeg_error_mgr errors;
  jpeg_progress_mgr progress;
  jpeg_decompress_struct jpeg;
  bool usable = false;

  State() { open(); }
  ~State() { jpeg_destroy_decompress(&jpeg); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void open() noexcept {
    jpeg = {};
    progress = {};
    jpeg.err = jpeg_std_error(&errors);
    errors.error_exit = leave;
    errors.emit_message = judge_message;
    errors.output_message = [](j_common_ptr) {};
    jpeg.client_data = &caller;
    usable = ends_well(caller, [this] {
      jpeg_create_decompress(&jpeg);
      return true;
    });
    progress.progress_monitor = limit_scans;
    jpeg.progress = &progress;
  }

  void open_afresh() noexcept {
    jpeg_destroy_decompress(&jpeg);
    open();
  }

  /// Between header and scan: moves on to the last restart marker from which whole rows of blocks
  /// follow, row `y` (px) among them. Returns how many rows of pixels were passed; none where the
  /// picture has no such markers.
  int pass_rows_above(int y) {
    caller.markers_passed = 0;
    const bool interleaved = jpeg.num_components > 1;
    if (jpeg.restart_interval == 0 || jpeg.progressive_mode || jpeg.arith_code ||
        jpeg.comps_in_scan != jpeg.num_components || (!interleaved && jpeg.max_v_samp_factor > 1))
      return 0;
    // A minimum coded unit; of a single component it is one block (T.81, A.2).
    const std::int64_t unit_width = DCTSIZE * (interleaved ? jpeg.max_h_samp_factor : 1);
    const std::int64_t unit_height = DCTSIZE * jpeg.max_v_samp_factor;
    const std::int64_t units_per_row = (jpeg.image_width + unit_width - 1) / unit_width;
    std::int64_t row = y / unit_height;
    while (row * units_per_row % jpeg.restart_interval != 0) --row;
    if (row == 0) return 0;
    caller.markers_passed = row * units_per_row / jpeg.restart_interval;
    jpeg_source_mgr& source = *jpeg.src;
    const auto entry = after_restart_markers({source.next_input_byte, source.bytes_in_buffer},
                                             caller.markers_passed);
    if (!entry) leave(common(jpeg));
    source.next_input_byte += *entry;
    source.bytes_in_buffer -= *entry;
    source.resync_to_restart = judge_restart;
    return static_cast<int>(row * unit_height);
  }

  /// Only inside ends_well().
  bool read(std::span<const std::uint8_t> bytes, int width, int height, const Region& region,
            std::uint8_t* luma, Region& written) {
    jpeg_mem_src(&jpeg, bytes.data(), static_cast<unsigned long>(bytes.size()));
    jpeg_read_header(&jpeg, TRUE);
    if (static_cast<int>(jpeg.image_width) != width ||
        static_cast<int>(jpeg.image_height) != height || !luminance_is_finest(jpeg))
      return false;
    // Grey output makes libjpeg skip the chroma transforms. Huffman tables that a webcam leaves out
    // are the standard ones, which libjpeg-turbo supplies by itself.
    jpeg.out_color_space = JCS_GRAYSCALE;
    jpeg.do_block_smoothing = FALSE;               // guesses of an unfinished progressive picture
    const int passed = pass_rows_above(region.y);  // libjpeg takes the next row for the first
    jpeg_start_decompress(&jpeg);

    auto left = static_cast<JDIMENSION>(region.x);
    auto columns = static_cast<JDIMENSION>(region.width);
    if (region.width < width) jpeg_crop_scanline(&jpeg, &left, &columns);
    written = {static_cast<int>(left), region.y, static_cast<int>(columns), region.height};
    if (region.y > passed) jpeg_skip_scanlines(&jpeg, static_cast<JDIMENSION>(region.y - passed));
    for (int y = region.y; y < region.y + region.height; ++y) {
      JSAMPROW row = luma + static_cast<std::ptrdiff_t>(y) * width + written.x;
      jpeg_read_scanlines(&jpeg, &row, 1);
    }
    // All rows were read: whatever is wrong in the rest of the file counts too.
    if (jpeg.output_scanline == jpeg.output_height) jpeg_finish_decompress(&jpeg);
    return true;
  }
};

JpegLuma::JpegLuma(int width, int height)
    : state_(std::make_unique<State>()), width_(width), height_(height) {
  if (!state_->usable) throw ConfigError("libjpeg: cannot start a decoder: out of memory");
}

JpegLuma::~JpegLuma() = default;
JpegLuma::JpegLuma(JpegLuma&&) noexcept = default;
JpegLuma& JpegLuma::operator=(JpegLuma&&) noexcept = default;

std::optional<Region> JpegLuma::decode(std::span<const std::uint8_t> jpeg, const Region& region,
                                       std::uint8_t* luma) noexcept {
  State& state = *state_;
  if (!state.usable) state.open_afresh();
  Region written;
  const bool good = state.usable && ends_well(state.caller, [&, this] {
                      return state.read(jpeg, width_, height_, region, luma, written);
                    });
  if (!good) {
    // libjpeg can stay unusable after damaged tables, and would lend them to frames that bring
    // none.
    state.open_afresh();
    return std::nullopt;
  }
  jpeg_abort_decompress(&state.jpeg);
  return written;
}

std::optional<std::size_t> after_restart_markers(std::span<const std::uint8_t> data,
                                                 std::int64_t count) noexcept {
  constexpr std::uint8_t kPrefix = 0xFF, kStuffed = 0x00, kFirst = 0xD0;
  const std::uint8_t* at = data.data();
  const std::uint8_t* const end = at + data.size();
  for (std::int64_t seen = 0; seen < count;) {
    if (at == end) return std::nullopt;
    at = static_cast<const std::uint8_t*>(
        std::memchr(at, kPrefix, static_cast<std::size_t>(end - at)));
    if (at == nullptr || end - at < 2) return std::nullopt;
    const std::uint8_t code = *++at;
    if (code == kPrefix) continue;  // fill bytes may precede a marker
    ++at;
    if (code == kStuffed) continue;
    if (code != kFirst + seen % 8) return std::nullopt;
    ++seen;
  }
  return static_cast<std::size_t>(at - data.data());
}

std::optional<PixelFormat> pixel_format(std::uint32_t fourcc) noexcept {
  if (fourcc == code("JPEG")) return PixelFormat::mjpg;
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (fourcc == code(kNames[i])) return static_cast<PixelFormat>(i);
  return std::nullopt;
}

std::optional<PixelFormat> pixel_format(std::string_view text) noexcept {
  if (text.size() != 4) return std::nullopt;
  char upper[5] = {};
  std::transform(text.begin(), text.end(), upper,
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return pixel_format(code({upper, 4}));
}

std::string_view name(PixelFormat format) noexcept {
  return kNames[static_cast<std::size_t>(format)];
}

std::uint32_t fourcc_of(PixelFormat format) noexcept {
  return code(kNames[static_cast<std::size_t>(format)]);
}

int row_bytes(PixelFormat format, int width) noexcept {
  switch (format) {
    case PixelFormat::grey:
    case PixelFormat::nv12: return width;
    case PixelFormat::yuyv:
    case PixelFormat::uyvy: return 2 * width;
    case PixelFormat::mjpg: break;
  }
  return 0;
}

Decoder::Decoder(PixelFormat format, int width, int height, int stride)
    : format_(format),
      width_(width),
      height_(height),
      stride_(std::max(stride, row_bytes(format, width))) {
  if (!borrows()) luma_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (format == PixelFormat::mjpg) jpeg_.emplace(width, height);
}

bool Decoder::decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
                     ImageView& image) noexcept {
  Region decoded;
  return decode(buffer, bytes_used, {}, image, decoded);
}

bool Decoder::decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
                     const Region& wanted, ImageView& image, Region& decoded) noexcept {
  if (bytes_used == 0 || bytes_used > buffer.size()) return false;
  const auto bytes = buffer.first(bytes_used);
  const auto row = static_cast<std::size_t>(row_bytes(format_, width_));
  const auto step = static_cast<std::size_t>(stride_);
  if (format_ != PixelFormat::mjpg &&
      bytes.size() < step * static_cast<std::size_t>(height_ - 1) + row)
    return false;
  if (borrows()) {
    image = {bytes.data(), width_, height_, stride_};
    decoded = {0, 0, width_, height_};
    return true;
  }
  Region region = wanted.clipped(width_, height_);
  if (jpeg_) {
    const std::optional<Region> written = jpeg_->decode(bytes, region, luma_.data());
    if (!written) return false;
    region = *written;
  } else {
    const std::ptrdiff_t luma_at = format_ == PixelFormat::uyvy ? 1 : 0;
    for (int y = region.y; y < region.y + region.height; ++y) {
      take_every_second_byte(bytes.data() + y * std::ptrdiff_t{stride_} + 2 * region.x + luma_at,
                             luma_.data() + y * std::ptrdiff_t{width_} + region.x, region.width);
    }
  }
  image = {luma_.data(), width_, height_, width_};
  decoded = region;
  return true;
}

std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8) return jpeg_size(bytes);
  if (const auto pgm = pgm_header(bytes)) return checked(pgm->width, pgm->height);
  if (const auto png = png_header(bytes)) return checked(png->width, png->height);
  return std::nullopt;
}

std::optional<PgmHeader> pgm_header(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < 3 || bytes[0] != 'P' || (bytes[1] != '5' && bytes[1] != '2') ||
      !is_space(bytes[2]))
    return std::nullopt;
  std::size_t at = 2;
  const auto width = number(bytes, at);
  const auto height = width ? number(bytes, at) : std::nullopt;
  const auto white = height ? number(bytes, at) : std::nullopt;
  // One white space ends the header: without it the last number may go on.
  if (!white || *white == 0 || at >= bytes.size() || !is_space(bytes[at])) return std::nullopt;
  return PgmHeader{*width, *height, *white, bytes[1] == '2', at + 1};
}

bool decode_pgm(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey) {
  const auto header = pgm_header(bytes);
  if (!header || width < 1 || height < 1 || header->width != static_cast<std::uint32_t>(width) ||
      header->height != static_cast<std::uint32_t>(height))
    return false;
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto pixels = bytes.subspan(header->size);
  return header->plain ? decode_plain(pixels, header->white, grey)
                       : decode_binary(pixels, header->white, grey);
}

bool RawDecoder::decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept {
  const bool pgm = raw.fourcc == fourcc("PGM ");
  if (pgm || raw.fourcc == fourcc("PNG ")) {
    // Asked first, so that a damaged file cannot make a decoder allocate without bound.
    if (image_size(raw.bytes) != ImageSize{width_, height_}) return false;
    if (!(pgm ? decode_pgm(raw.bytes, width_, height_, grey_)
              : decode_png(raw.bytes, width_, height_, grey_)))
      return false;
    frame.image = {grey_.data(), width_, height_, width_};
    frame.decoded = {};
    return true;
  }
  if (!decoder_ || decodes_ != raw.fourcc || stride_ != raw.stride) {
    const std::optional<PixelFormat> format = pixel_format(raw.fourcc);
    if (!format) return false;
    decoder_.emplace(*format, width_, height_, raw.stride);
    decodes_ = raw.fourcc;
    stride_ = raw.stride;
  }
  return decoder_->decode(raw.bytes, raw.bytes.size(), wanted, frame.image, frame.decoded);
}

}  // namespace tagwrench
