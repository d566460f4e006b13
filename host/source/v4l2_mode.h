// What a camera can do, what was asked, and the choice between: pure, no device.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/source/decode.h"

namespace tagwrench {

/// One line of a camera's list: a size in a pixel format, at one rate or a range of rates.
struct V4l2Mode {
  PixelFormat pixels = PixelFormat::grey;
  std::uint32_t fourcc = 0;  ///< the driver's own code for `pixels`
  int width = 0;
  int height = 0;
  double fps_min = 0;  ///< equal to fps_max for a fixed rate; both 0 where the driver does not say
  double fps_max = 0;
};

/// Zero and nullopt mean "you choose".
struct V4l2Options {
  std::string path;  ///< /dev/videoN or a stable link to one
  int width = 0;     ///< both or neither
  int height = 0;
  double fps = 0;
  std::optional<PixelFormat> pixels;
  int preferred_width =
      640;  ///< the sensor's size, taken when no size is asked and the camera has it
  int preferred_height = 480;
  int exposure_us = 0;  ///< 0 keeps what automatic exposure settled on
};

/// Reads PATH[,WIDTHxHEIGHT[@FPS][,FOURCC]]; throws ConfigError that quotes the part that is wrong.
V4l2Options parse_v4l2_spec(std::string_view spec);

struct V4l2Choice {
  V4l2Mode mode;
  double fps = 0;  ///< to ask of the driver; 0 where it does not say
};

/// The best mode that fits what was asked: the size asked, or the one nearest to the preferred;
/// then the highest rate (or the rate asked, within 1 %); then uncompressed over MJPG, and of those
/// the cheapest to decode.
std::optional<V4l2Choice> choose_mode(std::span<const V4l2Mode> modes, const V4l2Options& options);

/// "640x480 YUYV 30 fps".
std::string describe(const V4l2Mode& mode);
/// A short list, best first: at most `limit` modes, then "and N more".
std::string describe(std::span<const V4l2Mode> modes, std::size_t limit);

}  // namespace tagwrench
