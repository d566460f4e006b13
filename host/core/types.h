// Room core: what all rooms speak of, and what they stand on. It uses no other room.
// Beside this: config_error.h (set-up's errors), log.h (lines for people), os/ (files, signals,
// processes), yaml/, json/, png/, algebra/ (decompositions), robust_statistics.h.
//
// The words of the house: frames, poses, wrenches and samples, with their units and axes, stated
// once.
//
// Units     SI. A number that is not SI carries its unit in its name (_px, _mm, _us, _counts).
// Time      std::chrono on the kernel's CLOCK_MONOTONIC (libstdc++'s steady_clock reads it).
// Camera    x right, y down, z away from the lens; pixel centres at integer coordinates.
// Platform  origin at the midpoint of the tag centres, axes parallel to the camera's at rest.
// Tag       origin at the tag's centre, x right, y down, z into the paper, as printed.
// HID       X right, Y toward the user, Z down (HID usage tables, section 4.2), right-handed.
// Poses     camera_T_platform maps platform coordinates to camera coordinates:
//           p_camera = camera_T_platform * p_platform.
// Order     six-vectors are translation before rotation, force before torque: (x y z rx ry rz), (Fx
// Fy Fz Mx My Mz).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

namespace tagwrench {

using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::nanoseconds;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// 8-bit luminance, borrowed from its owner (a kernel buffer, a decoder, a renderer). Row r starts
/// at pixels + r * stride.
struct ImageView {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;
};

/// A rectangle of pixels in the coordinates of an ImageView as delivered, that is of the camera's
/// raw image, mirrored or not: columns x to x + width - 1, rows y to y + height - 1. Empty stands
/// for the whole image wherever a region is asked for or told.
struct Region {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  constexpr bool empty() const { return width <= 0 || height <= 0; }
  constexpr bool contains(const Region& other) const {
    return other.x >= x && other.y >= y && other.x + other.width <= x + width &&
           other.y + other.height <= y + height;
  }
  /// What lies within an image of this size; all of it if nothing does, or if this is empty. Safe
  /// for numbers of any size.
  constexpr Region clipped(int image_width, int image_height) const {
    const auto span = [](int from, int count, int limit) {
      const auto begin = std::clamp<std::int64_t>(from, 0, limit);
      const auto end = std::clamp<std::int64_t>(std::int64_t{from} + count, 0, limit);
      return std::pair{static_cast<int>(begin), static_cast<int>(end - begin)};
    };
    const auto [left, columns] = span(x, width, image_width);
    const auto [top, rows] = span(y, height, image_height);
    const Region inside{left, top, columns, rows};
    return inside.empty() ? Region{0, 0, image_width, image_height} : inside;
  }
  constexpr bool operator==(const Region&) const = default;
};

/// One picture as its source delivered it; valid until the source's next read().
struct Frame {
  ImageView image;
  Region decoded;  ///< the part of `image` that shows this picture. The rest is undefined (of an
                   ///< earlier picture, or never written) and must not be read. Empty: all of it
  TimePoint
      capture_time{};  ///< the kernel's capture time, or the recording's or simulator's own clock
  TimePoint
      latency_origin{};  ///< where latency counts from, always CLOCK_MONOTONIC: equal to
                         ///< capture_time for live sources, the hand-over time for replayed ones
  std::uint64_t sequence = 0;  ///< counts the frames that the source captured, lost ones included
  std::uint32_t dropped = 0;   ///< frames lost since the previous Frame
  std::optional<Duration> recorded_latency;  ///< of a replayed frame: latency_origin to the output
                                             ///< call, when it was recorded
  bool touched = false;  ///< of a replayed frame: somebody pressed a button of the board

  /// `decoded`, spelt out when it is all.
  constexpr Region readable() const { return decoded.clipped(image.width, image.height); }
};

/// Four characters as V4L2 packs them: 'G' of "GREY" is the lowest byte.
constexpr std::uint32_t fourcc(const char (&name)[5]) {
  std::uint32_t code = 0;
  for (int i = 4; i-- > 0;) code = code << 8 | static_cast<std::uint8_t>(name[i]);
  return code;
}

/// What a source had before it was decoded: a camera's buffer or a file's bytes. Valid as long as
/// its Frame.
struct RawFrame {
  /// GREY, NV12, YUYV, UYVY, MJPG (and any JPEG file), "PNG " and "PGM " for such files
  std::uint32_t fourcc = 0;
  std::span<const std::uint8_t> bytes;  ///< empty: the source keeps none
  int stride = 0;                       ///< bytes between rows, 0 where the format itself tells
};

enum class Status : std::uint8_t {
  ok,
  acquiring,  ///< no target yet
  lost,       ///< had the target (or the camera), has it no more
  doubtful,   ///< tracked, but the fit says do not trust it
  saturated,  ///< outside the calibrated range
};

/// Only these two carry numbers to outputs; every other status is a neutral output.
constexpr bool carries_numbers(Status status) {
  return status == Status::ok || status == Status::saturated;
}

constexpr const char* name(Status status) {
  switch (status) {
    case Status::ok: return "ok";
    case Status::acquiring: return "acquiring";
    case Status::lost: return "lost";
    case Status::doubtful: return "doubtful";
    case Status::saturated: return "saturated";
  }
  return "?";
}

/// What the tracker noticed that a person should be told; said once by whoever runs the loop.
enum class Diagnostic : std::uint8_t {
  none,
  image_looks_mirrored,     ///< tags decode only after a horizontal flip, and the sensor says
                            ///< mirrored: false
  image_looks_unmirrored,   ///< the reverse: the sensor says mirrored: true
  rest_learned,             ///< this frame completed the rest pose
  moved_while_learning,     ///< the platform moved during the rest frames; learning starts again
  appearance_does_not_fit,  ///< the target no longer looks like the picture that was loaded
  far_from_rest,  ///< held, and standing still since the start, but not where rest was given
  shutter_rolls,  ///< pictures of a moving target are sheared; the sensor says readout 0
  // Why the target is not held (tracker/diagnostics.h):
  image_black,           ///< lens cap on, no light
  image_saturated,       ///< much of it is white
  image_empty,           ///< even grey
  image_unsharp,         ///< contrast, but no sharp edge
  no_tag,                ///< nothing of what the sensor describes, and nothing known instead
  wrong_family,          ///< tags of another family
  wrong_ids,             ///< tags of the family, but other ones
  tag_missing,           ///< some of the tags, but not all
  tag_twice,             ///< one id in two places
  tag_printed_mirrored,  ///< some tags read as they are, others only when flipped
  other_scale,           ///< the tags' size does not go with the distances between them
  other_places,          ///< the tags sit differently to each other
  other_print,           ///< another tag of the family is where one of the target's should be
  rest_elsewhere,        ///< the target is out of reach of its rest pose
};

/// Says why the target is not held, and is true no longer when it is.
constexpr bool is_trouble(Diagnostic diagnostic) { return diagnostic >= Diagnostic::image_black; }

/// The numbers that go with a diagnostic; those that do not apply are empty or zero.
struct DiagnosticDetails {
  struct Ids {
    std::array<std::int16_t, 8> id{};
    std::uint8_t count = 0;

    constexpr void add(int tag) {
      if (count < id.size()) id[count++] = static_cast<std::int16_t>(tag);
    }
    constexpr bool operator==(const Ids&) const = default;
  };
  Ids expected;             ///< the sensor's tags
  Ids seen;                 ///< in view, whether expected or not
  Ids concerned;            ///< those that are missing, there twice, printed mirrored, or replaced
  std::string_view family;  ///< of the tags seen; a name that stays
  std::string_view expected_family;
  double amount = 0;  ///< grey level of the brightest pixels; part of pixels that are white; px
                      ///< that the sharpest edge is wide; size of the tags over what was described;
                      ///< readout (s); sway of a platform at rest (m)
  Vector6 offset = Vector6::Zero();  ///< from rest to where the target is, m and rad, camera axes
  bool rest_given = false;           ///< by the sensor's description, not learned
};

/// Where a tag lies in the image, by the fitted pose and not by what single corners look like.
struct TagCorners {
  int id = 0;
  std::array<double, 8> px{};  ///< x, y of its corners as printed: top left, top right, bottom
                               ///< right, bottom left; in the camera's raw image, mirrored or not
};

/// The platform's displacement from rest, as the tracker sees it. Numbers are zero unless status is
/// ok.
struct Track {
  Status status = Status::acquiring;
  Diagnostic diagnostic = Diagnostic::none;
  DiagnosticDetails details;               ///< of the diagnostic
  Vector6 displacement = Vector6::Zero();  ///< translation (m), rotation vector r with R_now =
                                           ///< exp(r) R_rest (rad), both along camera axes
  Matrix6 covariance = Matrix6::Zero();    ///< of displacement, m^2, m rad, rad^2
  double residual_px = 0;                  ///< RMS of the fit
  /// What the fit to the picture at rest leaves: RMS, over the contrast between black and white;
  /// and how much wider the image of an edge is than there, as growth of its variance, px^2. Both
  /// are zero where there is no such picture, and known even if status is doubtful.
  double residual_fraction = 0;
  double blur_px2 = 0;
  std::uint8_t tags_held = 0;           ///< number of tags that carried the fit
  std::array<TagCorners, 8> corners{};  ///< of the target's tags, while it is held
  std::uint8_t corner_count = 0;        ///< tags in `corners`; 0 while it is not
  Region wanted;                        ///< what the next frame must show to be tracked; empty: all
  bool needs_whole_frame = false;  ///< Frame::decoded was too small to tell: ask again with the
                                   ///< completed frame. If there is none, the rest stands
};

/// Whether the zero follows what reads while nobody touches the sensor.
enum class ZeroState : std::uint8_t {
  off,
  touched,    ///< somebody holds it, or it moves: the zero stays
  far,        ///< it stands still, but too far from zero to be taken for it
  following,  ///< it stands still, and nobody holds it
};

constexpr const char* name(ZeroState state) {
  switch (state) {
    case ZeroState::off: return "off";
    case ZeroState::touched: return "touched";
    case ZeroState::far: return "far";
    case ZeroState::following: return "following";
  }
  return "?";
}

/// One line of output: all that the instrument knows about one frame.
struct Sample {
  std::uint64_t sequence = 0;
  TimePoint capture_time{};
  TimePoint latency_origin{};
  Status status = Status::acquiring;
  Vector6 displacement = Vector6::Zero();        ///< m, rad
  Vector6 displacement_sigma = Vector6::Zero();  ///< one standard deviation, m, rad
  Vector6 wrench = Vector6::Zero();        ///< N, N m: what the user applies TO the platform, about
                                           ///< wrench_origin, along wrench_frame
  Vector6 wrench_sigma = Vector6::Zero();  ///< one standard deviation, N, N m
  Vector6 zero = Vector6::Zero();  ///< N, N m: what `tagwrench zero` and the following of zero have
                                   ///< taken off the wrench
  ZeroState zero_state = ZeroState::off;
  bool touched = false;                  ///< somebody presses a button of the board
  Vector6 deflection = Vector6::Zero();  ///< -1..1 per axis in the HID frame, dead zone and full
                                         ///< scale applied; exactly zero at rest
  std::uint32_t buttons = 0;  ///< pressed, bit 0 is the first: the board's, and what gestures press
  std::uint32_t dropped = 0;
  TimePoint output_time{};  ///< when it was handed to the outputs, on latency_origin's clock; the
                            ///< same for all of them
};

}  // namespace tagwrench
