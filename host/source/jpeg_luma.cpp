#include "host/source/jpeg_luma.h"

#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <type_traits>

#include "host/core/config_error.h"

// jpeglib.h uses FILE and size_t, but does not include what declares them.
// clang-format off
// clang-format on

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

void say_nothing(j_common_ptr /*jpeg*/) {}

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
    errors.output_message = say_nothing;
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

  bool read(std::span<const std::uint8_t> bytes, int width, int height, const Region& region,
            std::uint8_t* luma, Region& written);

 private:
  int pass_rows_above(int y);
};

/// Between header and scan: moves on to the last restart marker from which whole rows of blocks
/// follow, row `y` (px) among them. Returns how many rows of pixels were passed; none where the
/// picture has no such markers.
int JpegLuma::State::pass_rows_above(int y) {
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
bool JpegLuma::State::read(std::span<const std::uint8_t> bytes, int width, int height,
                           const Region& region, std::uint8_t* luma, Region& written) {
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

}  // namespace tagwrench
