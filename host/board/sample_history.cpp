#include "host/board/sample_history.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::link {
namespace {

constexpr double kGapPeriods = 1.5;
constexpr double kForget = 1.0 / 64;  ///< of the noise, per sample
constexpr std::uint64_t kEnough = 8;  ///< third differences
constexpr double kThirdOfNoise = 20;  ///< 1 + 9 + 9 + 1

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

void SampleHistory::clear() noexcept {
  samples_.clear();
  third_squares_ = 0;
  thirds_ = 0;
}

void SampleHistory::add(TimePoint time, Duration time_sigma, double value, double sigma,
                        bool lost_before) noexcept {
  const auto delay = Duration(std::llround(options_.delay * 1e9));
  Sample sample{time - delay, seconds(time_sigma), value, sigma, lost_before};
  if (!samples_.empty()) {
    const double apart = seconds(sample.time - samples_.back().time);
    if (apart <= 0) return;
    if (options_.period > 0 && apart > kGapPeriods * options_.period) sample.after_gap = true;
  }
  samples_.push(sample);
  watch_noise();
}

void SampleHistory::watch_noise() noexcept {
  const std::size_t n = samples_.size();
  if (n < 4) return;
  for (std::size_t i = n - 3; i < n; ++i)
    if (samples_[i].after_gap) return;
  const double third = samples_[n - 1].value - 3 * samples_[n - 2].value +
                       3 * samples_[n - 3].value - samples_[n - 4].value;
  ++thirds_;
  const double weight = std::max(kForget, 1.0 / static_cast<double>(thirds_));
  third_squares_ += weight * (third * third - third_squares_);
}

double SampleHistory::noise() const noexcept {
  return thirds_ < kEnough ? 0 : std::sqrt(third_squares_ / kThirdOfNoise);
}

std::size_t SampleHistory::first_after(TimePoint time) const noexcept {
  // The newest is what is asked about: few steps back from the end.
  std::size_t first = samples_.size();
  while (first > 0 && samples_[first - 1].time > time) --first;
  return first;
}

/// Mean size of the second differences on either side of the interval that ends at `right`.
double SampleHistory::bend(std::size_t right) const noexcept {
  double sum = 0;
  int count = 0;
  const auto second = [&](std::size_t middle) {
    sum += std::abs(samples_[middle + 1].value - 2 * samples_[middle].value +
                    samples_[middle - 1].value);
    ++count;
  };
  if (right >= 2 && !samples_[right - 1].after_gap) second(right - 1);
  if (right + 1 < samples_.size() && !samples_[right + 1].after_gap) second(right);
  return count == 0 ? 0 : sum / count;
}

Aligned SampleHistory::at(TimePoint time) const noexcept {
  if (samples_.empty()) return {};
  if (time < samples_[0].time) return {AlignStatus::too_old};
  const std::size_t right = first_after(time);
  if (right == samples_.size()) {
    if (time > samples_.back().time || right == 1) return {AlignStatus::too_new};
    return at(time - Duration(1));  // exactly the last sample
  }
  const Sample& a = samples_[right - 1];
  const Sample& b = samples_[right];
  if (b.after_gap) return {AlignStatus::gap};
  const double h = seconds(b.time - a.time);
  const double u = seconds(time - a.time) / h;
  const double slope = (b.value - a.value) / h;
  const double noise_now = noise() * std::sqrt((1 - u) * (1 - u) + u * u);
  const double shift = std::max(a.time_sigma, b.time_sigma) * slope;
  const double scale = (1 - u) * a.sigma + u * b.sigma;
  const double between = 0.5 * u * (1 - u) * bend(right);
  return {AlignStatus::ok, a.value + u * (b.value - a.value),
          std::sqrt(noise_now * noise_now + shift * shift + scale * scale + between * between)};
}

}  // namespace tagwrench::link
