#include "host/source/v4l2_mode.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr int kMaxSide = 16384;
constexpr double kMaxFps = 10000;
constexpr double kRateTolerance = 0.01;  ///< 29.97 and 30 are the same rate

[[noreturn]] void bad_spec(std::string_view spec, std::string_view part, std::string_view why) {
  throw ConfigError("v4l2:{}: '{}' {}; write v4l2:/dev/videoN[,WIDTHxHEIGHT[@FPS][,FOURCC]]", spec,
                    part, why);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

std::optional<int> side(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 1 || value > kMaxSide)
    return std::nullopt;
  return value;
}

std::optional<double> rate(std::string_view text) {
  double value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc{} || end != text.data() + text.size() || !(value > 0) || value > kMaxFps)
    return std::nullopt;
  return value;
}

bool same_rate(double a, double b) { return std::abs(a - b) <= kRateTolerance * std::max(a, b); }

/// How far a size is from the preferred one: the ratio of areas, either way, as a logarithm.
double distance(const V4l2Mode& mode, const V4l2Options& options) {
  if (mode.width == options.preferred_width && mode.height == options.preferred_height) return -1;
  const double area = static_cast<double>(mode.width) * mode.height;
  const double request =
      std::max(1.0, static_cast<double>(options.preferred_width) * options.preferred_height);
  return std::abs(std::log(area / request));
}

/// The rate to ask of this mode, or nothing if it does not have the rate asked.
std::optional<double> offered_rate(const V4l2Mode& mode, const V4l2Options& options) {
  if (options.fps <= 0) return mode.fps_max;
  if (mode.fps_max <= 0) return options.fps;
  if (same_rate(options.fps, mode.fps_max)) return mode.fps_max;
  if (same_rate(options.fps, mode.fps_min)) return mode.fps_min;
  if (options.fps > mode.fps_min && options.fps < mode.fps_max) return options.fps;
  return std::nullopt;
}

bool better(const V4l2Choice& a, const V4l2Choice& b, const V4l2Options& options) {
  const double da = distance(a.mode, options);
  const double db = distance(b.mode, options);
  if (std::abs(da - db) > 1e-9) return da < db;
  if (a.mode.width != b.mode.width) return a.mode.width > b.mode.width;
  if (!same_rate(a.fps, b.fps)) return a.fps > b.fps;
  return a.mode.pixels < b.mode.pixels;
}

}  // namespace

V4l2Options parse_v4l2_spec(std::string_view spec) {
  const auto parts = split(spec, ',');
  V4l2Options options;
  options.path = parts[0];
  if (options.path.empty() || options.path.front() != '/')
    bad_spec(spec, parts[0], "is not a path to a device");
  if (parts.size() > 3) bad_spec(spec, parts[3], "is one part too many");
  if (parts.size() > 1) {
    const auto at = parts[1].find('@');
    const auto size = parts[1].substr(0, at);
    const auto times = size.find_first_of("xX");
    const auto width = side(size.substr(0, times));
    const auto height =
        times == std::string_view::npos ? std::nullopt : side(size.substr(times + 1));
    if (!width || !height) bad_spec(spec, size, "is not a size in pixels such as 640x480");
    options.width = *width;
    options.height = *height;
    if (at != std::string_view::npos) {
      const auto fps = rate(parts[1].substr(at + 1));
      if (!fps) bad_spec(spec, parts[1].substr(at), "is not a rate in frames a second such as @30");
      options.fps = *fps;
    }
  }
  if (parts.size() > 2) {
    options.pixels = pixel_format(parts[2]);
    if (!options.pixels) bad_spec(spec, parts[2], "is not one of GREY, YUYV, UYVY, NV12, MJPG");
  }
  return options;
}

std::optional<V4l2Choice> choose_mode(std::span<const V4l2Mode> modes, const V4l2Options& options) {
  std::optional<V4l2Choice> best;
  for (const V4l2Mode& mode : modes) {
    if (options.width > 0 && (mode.width != options.width || mode.height != options.height))
      continue;
    if (options.pixels && mode.pixels != *options.pixels) continue;
    const auto fps = offered_rate(mode, options);
    if (!fps) continue;
    const V4l2Choice choice{mode, *fps};
    if (!best || better(choice, *best, options)) best = choice;
  }
  return best;
}

std::string describe(const V4l2Mode& mode) {
  std::string text = fmt::format("{}x{} {}", mode.width, mode.height, name(mode.pixels));
  if (mode.fps_max > 0) text += fmt::format(" {:.4g} fps", mode.fps_max);
  return text;
}

std::string describe(std::span<const V4l2Mode> modes, std::size_t limit) {
  // One line a size and format, at its best rate.
  std::vector<V4l2Mode> best;
  for (const V4l2Mode& mode : modes) {
    const auto same = std::find_if(best.begin(), best.end(), [&](const V4l2Mode& other) {
      return other.width == mode.width && other.height == mode.height &&
             other.pixels == mode.pixels;
    });
    if (same == best.end())
      best.push_back(mode);
    else if (mode.fps_max > same->fps_max)
      *same = mode;
  }
  const V4l2Options defaults;
  std::stable_sort(best.begin(), best.end(), [&](const V4l2Mode& a, const V4l2Mode& b) {
    return better({a, a.fps_max}, {b, b.fps_max}, defaults);
  });
  std::string text;
  for (std::size_t i = 0; i < std::min(limit, best.size()); ++i)
    text += (i ? ", " : "") + describe(best[i]);
  if (best.size() > limit) text += fmt::format(" and {} more", best.size() - limit);
  return text.empty() ? "none that is understood" : text;
}

}  // namespace tagwrench
