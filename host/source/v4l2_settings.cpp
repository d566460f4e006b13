#include "host/source/v4l2_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr int kMaxSide = 16384;
constexpr double kMaxFps = 10000;
constexpr double kRateTolerance = 0.01;  ///< 29.97 and 30 are the same rate

[[noreturn]] void bad_spec(std::string_view spec, std::string_view part, std::string_view why) {
  throw ConfigError("v4l2:{}: '{}' {}; write v4l2:/dev/videoN[,WIDTHxHEIGHT[@FPS][,FOURCC]]", spec,
                    part, why);
}

std::optional<int> side(std::string_view text) {
  const auto value = parse_whole<int>(text);
  return value && *value >= 1 && *value <= kMaxSide ? value : std::nullopt;
}

std::optional<double> rate(std::string_view text) {
  const auto value = parse_whole<double>(text, std::chars_format::fixed);
  return value && *value > 0 && *value <= kMaxFps ? value : std::nullopt;
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

enum class Kind : std::uint8_t {
  before,      ///< set to `off` before settling
  automatism,  ///< set to `off` when locking
  value,       ///< kept where it stands when locking
};

struct Control {
  std::uint32_t id;
  Kind kind;
  std::int32_t off;
  std::string_view what;
};

// In the order of locking: an automatism before the value that it governs.
constexpr std::array<Control, 14> kControls = {{
    {V4L2_CID_EXPOSURE_AUTO_PRIORITY, Kind::before, 0, "dynamic frame rate"},
    {V4L2_CID_EXPOSURE_AUTO, Kind::automatism, V4L2_EXPOSURE_MANUAL, "automatic exposure"},
    {V4L2_CID_EXPOSURE_ABSOLUTE, Kind::value, 0, "exposure"},
    {V4L2_CID_AUTOGAIN, Kind::automatism, 0, "automatic gain"},
    {V4L2_CID_GAIN, Kind::value, 0, "gain"},
    {V4L2_CID_AUTO_WHITE_BALANCE, Kind::automatism, 0, "automatic white balance"},
    {V4L2_CID_WHITE_BALANCE_TEMPERATURE, Kind::value, 0, "white balance"},
    {V4L2_CID_FOCUS_AUTO, Kind::automatism, 0, "automatic focus"},
    {V4L2_CID_FOCUS_ABSOLUTE, Kind::value, 0, "focus"},
    {V4L2_CID_AUTOBRIGHTNESS, Kind::automatism, 0, "automatic brightness"},
    {V4L2_CID_BRIGHTNESS, Kind::value, 0, "brightness"},
    {V4L2_CID_SHARPNESS, Kind::value, 0, "sharpness"},
    {V4L2_CID_BACKLIGHT_COMPENSATION, Kind::value, 0, "backlight compensation"},
    {V4L2_CID_POWER_LINE_FREQUENCY, Kind::value, 0, "power-line frequency"},
}};
constexpr std::int64_t kExposureUnit_us = 100;  ///< of V4L2_CID_EXPOSURE_ABSOLUTE

bool control_ioctl(int fd, unsigned long request, void* argument) {
  return uninterrupted([&] { return ::ioctl(fd, request, argument); }) == 0;
}

std::int32_t within(const ControlRange& range, std::int64_t value) {
  const std::int64_t step = std::max(1, range.step);
  const std::int64_t low = range.minimum;
  const std::int64_t high = std::max<std::int64_t>(low, range.maximum);
  const std::int64_t clamped = std::clamp(value, low, high);
  return static_cast<std::int32_t>(low + (clamped - low) / step * step);
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

std::optional<ControlRange> V4l2ControlPort::range(std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  if (!control_ioctl(fd_, VIDIOC_QUERYCTRL, &query) || (query.flags & V4L2_CTRL_FLAG_DISABLED))
    return std::nullopt;
  return ControlRange{query.minimum, query.maximum, query.step,
                      (query.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0};
}

std::optional<std::int32_t> V4l2ControlPort::get(std::uint32_t id) {
  v4l2_control control{};
  control.id = id;
  if (!control_ioctl(fd_, VIDIOC_G_CTRL, &control)) return std::nullopt;
  return control.value;
}

bool V4l2ControlPort::set(std::uint32_t id, std::int32_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  return control_ioctl(fd_, VIDIOC_S_CTRL, &control);
}

void ControlLock::remember(ControlPort& port) {
  for (std::size_t i = 0; i < kControls.size(); ++i) {
    const Control& control = kControls[i];
    const auto range = port.range(control.id);
    const auto now = range && range->writable ? port.get(control.id) : std::nullopt;
    if (!now) {
      absent_.push_back(i);
      continue;
    }
    original_.push_back({i, *now});
    if (control.kind == Kind::automatism && *now != control.off) needs_settling_ = true;
    if (control.kind == Kind::before) apply(port, i, control.off);
  }
}

void ControlLock::lock(ControlPort& port, int exposure_us) {
  // Read all before anything stops: some cameras jump back to an old value when an automatism does.
  std::vector<Setting> wanted;
  for (const Setting& setting : original_) {
    const Control& control = kControls[setting.index];
    if (control.kind == Kind::automatism) wanted.push_back({setting.index, control.off});
    if (control.kind != Kind::value) continue;
    std::int32_t value = port.get(control.id).value_or(setting.value);
    if (control.id == V4L2_CID_EXPOSURE_ABSOLUTE && exposure_us > 0)
      value = static_cast<std::int32_t>(exposure_us / kExposureUnit_us);
    // With exposure held, the camera's own search for the mains frequency can only disturb.
    if (control.id == V4L2_CID_POWER_LINE_FREQUENCY && value == V4L2_CID_POWER_LINE_FREQUENCY_AUTO)
      value = V4L2_CID_POWER_LINE_FREQUENCY_DISABLED;
    wanted.push_back({setting.index, value});
  }
  for (const Setting& setting : wanted) apply(port, setting.index, setting.value);
}

void ControlLock::apply(ControlPort& port, std::size_t index, std::int32_t value) {
  const Control& control = kControls[index];
  const auto range = port.range(control.id);
  const std::int32_t wanted = range ? within(*range, value) : value;
  bool done = port.set(control.id, wanted);
  std::int32_t final_value = wanted;
  if (!done && control.id == V4L2_CID_EXPOSURE_AUTO) {
    // A camera with an iris may offer "exposure manual, iris automatic" only.
    final_value = V4L2_EXPOSURE_SHUTTER_PRIORITY;
    done = port.set(control.id, final_value);
  }
  if (done)
    locked_.push_back({index, final_value});
  else
    refused_.push_back(index);
}

bool ControlLock::change(ControlPort& port, std::uint32_t id, std::int64_t value) {
  for (Setting& setting : locked_) {
    if (kControls[setting.index].id != id) continue;
    const auto range = port.range(id);
    if (!range) return false;
    const std::int32_t wanted = within(*range, value);
    if (!port.set(id, wanted)) return false;
    setting.value = wanted;
    return true;
  }
  return false;
}

std::optional<std::int32_t> ControlLock::locked(std::uint32_t id) const noexcept {
  for (const Setting& setting : locked_)
    if (kControls[setting.index].id == id) return setting.value;
  return std::nullopt;
}

void ControlLock::relock(ControlPort& port) {
  for (const Setting& setting : locked_) port.set(kControls[setting.index].id, setting.value);
}

void ControlLock::restore(ControlPort& port) {
  for (const Kind kind : {Kind::value, Kind::automatism, Kind::before}) {
    for (const Setting& setting : original_) {
      const Control& control = kControls[setting.index];
      if (control.kind == kind) port.set(control.id, setting.value);
    }
  }
}

std::string ControlLock::available(ControlPort& port) {
  std::vector<std::string_view> names;
  for (const Control& control : kControls)
    if (const auto range = port.range(control.id); range && range->writable)
      names.push_back(control.what);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string ControlLock::description() const {
  if (original_.empty()) return "it has no controls to lock";
  std::string text;
  const auto list = [&text](std::string_view title, const std::vector<std::size_t>& controls) {
    if (controls.empty()) return;
    std::vector<std::string_view> names;
    for (const std::size_t index : controls) names.push_back(kControls[index].what);
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", title, fmt::join(names, ", "));
  };
  std::vector<std::size_t> locked, missing;
  for (const Setting& setting : locked_) locked.push_back(setting.index);
  // An automatism goes without saying where its value is not there either.
  for (const std::size_t index : absent_)
    if (kControls[index].kind != Kind::automatism) missing.push_back(index);
  list("locked", locked);
  list("refused", refused_);
  list("without", missing);
  return text;
}

}  // namespace tagwrench
