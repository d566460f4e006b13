#include "host/calibration/light/control.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace tagwrench {
namespace {

constexpr double kMaxStep = 4;  // one picture is not trusted further

/// Moves `value` by up to `factor` within `range`; what of the factor is left.
double take_up(double& value, double factor, const LightRange& range) noexcept {
  if (!range.settable()) return factor;
  const double before = std::max(value, 1e-9);
  value = std::clamp(before * factor, range.least, range.most);
  // From nothing, or to nothing, there is no factor: the next picture tells.
  if (value <= 0) return 1;
  return factor * before / value;
}

constexpr double kTagShare = 0.05;
constexpr double kPictureShare = 0.01;

struct Histogram {
  std::array<std::uint32_t, 256> count{};
  std::uint32_t total = 0;

  void add(std::uint8_t level) {
    ++count[level];
    ++total;
  }
  /// The level that this share of the pixels exceeds.
  double exceeded_by(double share) const {
    std::uint32_t left = static_cast<std::uint32_t>(share * total);
    for (std::size_t level = 256; level-- > 0;) {
      if (count[level] > left) return static_cast<double>(level);
      left -= count[level];
    }
    return 0;
  }
  std::uint32_t clipped() const {
    constexpr int kFirst = static_cast<int>(LightControl::kClipped_counts);
    return std::accumulate(count.begin() + kFirst, count.end(), 0U);
  }
};

bool within(const std::array<Eigen::Vector2d, 4>& corners, double x, double y) {
  bool left = false, right = false;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d edge = corners[(i + 1) % 4] - a;
    const double side = edge.x() * (y - a.y()) - edge.y() * (x - a.x());
    left = left || side < 0;
    right = right || side > 0;
  }
  return !(left && right);
}

Histogram tag_histogram(const ImageView& image, bool mirrored, const FoundTag& tag) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : tag.corners_px) box.extend(corner);
  const Eigen::Vector2d end(image.width - 1, image.height - 1);
  const Eigen::Vector2i low = box.min().cwiseMin(end).cwiseMax(0).cast<int>();
  const Eigen::Vector2i high = box.max().cwiseMin(end).cwiseMax(0).cast<int>();
  Histogram histogram;
  for (int y = low.y(); y <= high.y(); ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    for (int x = low.x(); x <= high.x(); ++x)
      if (within(tag.corners_px, x, y)) histogram.add(row[mirrored ? image.width - 1 - x : x]);
  }
  return histogram;
}

// A setting shows in the picture after next: one is being exposed, one may wait in the driver. One
// more for the LED's command.
constexpr int kFramesUntilSeen = 4;
constexpr int kMaxPictures = 24;
constexpr Duration kPatience = std::chrono::seconds(3);  // for one frame
constexpr double kMaxGain = 16;  // of a camera whose gain has no unit: as if its range were 1..16
constexpr double kMuchAmbient = 0.3;

struct Settling {
  FrameSource& source;
  Acquirer& finder;
  bool mirrored;
  Lamp& lamp;
  const UniqueFd& stop;
  Frame frame{};
  std::vector<FoundTag> tags{};
  LightReport report{};

  LightReport run() {
    LightControl control(limits());
    for (int pictures = 0; pictures < kMaxPictures; ++pictures) {
      apply(control.setting());
      if (!look()) break;
      tags = finder.find(frame.image).tags;
      const LightReading reading = read_light(frame.image, mirrored, tags);
      report.white_counts = reading.white_counts;
      report.setting = control.setting();
      report.state = control.take(reading);
      if (report.state != LightControl::State::settling) break;
    }
    report.tags_found = static_cast<int>(tags.size());
    if (!report.stopped) measure_ambient();
    return report;
  }

  LightLimits limits() const {
    LightLimits limits{{1, 1}, lamp.range_permille(), {1, 1}};
    if (const CameraLight* camera = source.camera_light()) {
      const CameraLight::Range exposure = camera->exposure_range_us();
      limits.exposure_us = {exposure.least, exposure.most};
      if (!limits.exposure_us.settable())
        limits.exposure_us = {camera->exposure_us(), camera->exposure_us()};
      const CameraLight::Range gain = camera->gain_range();
      if (gain.most > gain.least) limits.gain = {1, kMaxGain};
    }
    return limits;
  }

  void apply(const LightSetting& setting) {
    lamp.set_level(setting.led_permille);
    CameraLight* camera = source.camera_light();
    if (camera == nullptr) return;
    const CameraLight::Range exposure = camera->exposure_range_us();
    if (exposure.most > exposure.least) camera->set_exposure_us(setting.exposure_us);
    const CameraLight::Range gain = camera->gain_range();
    const double share = (setting.gain - 1) / (kMaxGain - 1);
    if (gain.most > gain.least) camera->set_gain(gain.least + share * (gain.most - gain.least));
  }

  /// The share of light that stays when the LED is off, in the same places.
  void measure_ambient() {
    lamp.set_level(0);
    const bool seen = look();
    if (seen && report.white_counts > 0) {
      const LightReading dark = read_light(frame.image, mirrored, tags);
      report.ambient_fraction = std::min(1.0, dark.white_counts / report.white_counts);
    }
    lamp.set_level(report.setting.led_permille);
    if (seen) look();  // nobody shall learn from a picture without light
  }

  /// The first picture that shows the present setting.
  bool look() {
    for (int frames = 0; frames < kFramesUntilSeen; ++frames) {
      report.stopped = !next_picture();
      if (report.stopped) return false;
    }
    return true;
  }

  bool next_picture() {
    const TimePoint until = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < until) {
      pollfd fds[3] = {
          {source.poll_fd(), POLLIN, 0}, {lamp.poll_fd(), POLLIN, 0}, {stop.get(), POLLIN, 0}};
      constexpr int kLook_ms = 100;
      ::poll(fds, 3, source.poll_fd() < 0 ? 0 : kLook_ms);
      if (fds[2].revents != 0) return false;
      if (fds[1].revents != 0) lamp.service();
      const ReadStatus status = source.read(frame);
      if (status == ReadStatus::end) return false;
      if (status == ReadStatus::frame) return true;
    }
    return false;
  }
};

}  // namespace

LightControl::LightControl(const LightLimits& limits) noexcept : limits_(limits) {
  setting_.exposure_us = std::clamp(limits.short_exposure_us, limits.exposure_us.least,
                                    std::max(limits.exposure_us.least, limits.exposure_us.most));
  setting_.led_permille = (limits.led_permille.least + limits.led_permille.most) / 2;
  setting_.gain = limits.gain.least;
}

LightControl::State LightControl::take(const LightReading& reading) noexcept {
  const bool clipped =
      reading.white_counts >= kClipped_counts || reading.clipped_fraction > kMaxClippedFraction;
  if (!clipped && std::abs(reading.white_counts - kTarget_counts) <= kTolerance_counts)
    return state_ = State::settled;
  const double wanted = kTarget_counts / std::max(reading.white_counts, 1.0);
  const LightSetting before = setting_;
  scale(clipped ? std::min(0.5, wanted) : std::clamp(wanted, 1 / kMaxStep, kMaxStep));
  const bool stuck = setting_.exposure_us == before.exposure_us &&
                     setting_.led_permille == before.led_permille && setting_.gain == before.gain;
  if (!stuck) return state_ = State::settling;
  return state_ = clipped || wanted < 1 ? State::too_bright : State::too_dark;
}

void LightControl::scale(double factor) noexcept {
  const LightRange& exposure = limits_.exposure_us;
  const double short_us = std::clamp(limits_.short_exposure_us, exposure.least, exposure.most);
  using Step = std::pair<double&, LightRange>;
  const std::array<Step, 4> brighter{{{setting_.exposure_us, {exposure.least, short_us}},
                                      {setting_.led_permille, limits_.led_permille},
                                      {setting_.gain, limits_.gain},
                                      {setting_.exposure_us, exposure}}};
  const std::array<Step, 4> darker{{{setting_.exposure_us, {short_us, exposure.most}},
                                    {setting_.gain, limits_.gain},
                                    {setting_.led_permille, limits_.led_permille},
                                    {setting_.exposure_us, exposure}}};
  for (const auto& [value, range] : factor > 1 ? brighter : darker)
    factor = take_up(value, factor, range);
}

LightReading read_light(const ImageView& image, bool mirrored, const std::vector<FoundTag>& tags) {
  LightReading reading;
  std::uint32_t clipped = 0, total = 0;
  for (const FoundTag& tag : tags) {
    const Histogram histogram = tag_histogram(image, mirrored, tag);
    reading.white_counts = std::max(reading.white_counts, histogram.exceeded_by(kTagShare));
    clipped += histogram.clipped();
    total += histogram.total;
  }
  if (total > 0) {
    reading.clipped_fraction = static_cast<double>(clipped) / total;
    return reading;
  }
  Histogram whole;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    for (int x = 0; x < image.width; ++x) whole.add(row[x]);
  }
  reading.white_counts = whole.exceeded_by(kPictureShare);
  return reading;
}

LightReport settle_light(FrameSource& source, Acquirer& finder, bool mirrored, Lamp& lamp,
                         const UniqueFd& stop) {
  return Settling{source, finder, mirrored, lamp, stop}.run();
}

std::string light_text(const LightReport& report) {
  std::string line = fmt::format(
      "light: LED {:.1f} %, white of the {} {:.0f} of 255", report.setting.led_permille / 10,
      report.tags_found > 0 ? "tags" : "picture (no tag found)", report.white_counts);
  if (report.setting.exposure_us > 1)
    line += fmt::format(", exposure {:.1f} ms", report.setting.exposure_us * 1e-3);
  if (report.setting.gain > 1) line += fmt::format(", gain {:.1f}", report.setting.gain);
  line += fmt::format(", {:.0f} % of it ambient", 100 * report.ambient_fraction);
  switch (report.state) {
    case LightControl::State::settling:
      return line + "; it did not become steady: does the light flicker?";
    case LightControl::State::too_dark:
      return line + "; too dark with everything at its end: is the LED wired, and the lens free?";
    case LightControl::State::too_bright:
      return line + "; too bright with everything at its end: keep other light off the tags";
    case LightControl::State::settled: break;
  }
  if (report.ambient_fraction > 0.9) return line + "; the LED hardly shows: is it wired?";
  if (report.ambient_fraction > kMuchAmbient) line += "; keep other light off the tags";
  return line;
}

}  // namespace tagwrench
