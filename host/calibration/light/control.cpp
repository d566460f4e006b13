#include "host/calibration/light/control.h"

#include <algorithm>
#include <cmath>

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

}  // namespace tagwrench
