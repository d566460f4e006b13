#include "host/calibration/light/control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

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

LightRange up_to(const LightRange& range, double most) noexcept {
  return {range.least, std::clamp(most, range.least, range.most)};
}

LightRange from(const LightRange& range, double least) noexcept {
  return {std::clamp(least, range.least, range.most), range.most};
}

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
  const double short_us = limits_.short_exposure_us;
  if (factor > 1) {
    factor = take_up(setting_.exposure_us, factor, up_to(limits_.exposure_us, short_us));
    factor = take_up(setting_.led_permille, factor, limits_.led_permille);
    factor = take_up(setting_.gain, factor, limits_.gain);
    take_up(setting_.exposure_us, factor, limits_.exposure_us);
  } else {
    factor = take_up(setting_.exposure_us, factor, from(limits_.exposure_us, short_us));
    factor = take_up(setting_.gain, factor, limits_.gain);
    factor = take_up(setting_.led_permille, factor, limits_.led_permille);
    take_up(setting_.exposure_us, factor, limits_.exposure_us);
  }
}

namespace {

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
    std::uint32_t sum = 0;
    for (auto level = static_cast<std::size_t>(LightControl::kClipped_counts); level < 256; ++level)
      sum += count[level];
    return sum;
  }
};

bool within(const std::array<Eigen::Vector2d, 4>& corners, double x, double y) {
  bool left = false;
  bool right = false;
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
  double x0 = image.width, x1 = -1, y0 = image.height, y1 = -1;
  for (const Eigen::Vector2d& corner : tag.corners_px) {
    x0 = std::min(x0, corner.x());
    x1 = std::max(x1, corner.x());
    y0 = std::min(y0, corner.y());
    y1 = std::max(y1, corner.y());
  }
  const auto clamped = [](double value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit - 1)));
  };
  Histogram histogram;
  if (x1 < x0 || y1 < y0) return histogram;
  for (int y = clamped(y0, image.height); y <= clamped(y1, image.height); ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    for (int x = clamped(x0, image.width); x <= clamped(x1, image.width); ++x) {
      if (within(tag.corners_px, x, y)) histogram.add(row[mirrored ? image.width - 1 - x : x]);
    }
  }
  return histogram;
}

}  // namespace

LightReading read_light(const ImageView& image, bool mirrored, const std::vector<FoundTag>& tags) {
  LightReading reading;
  std::uint32_t clipped = 0;
  std::uint32_t total = 0;
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

}  // namespace tagwrench
