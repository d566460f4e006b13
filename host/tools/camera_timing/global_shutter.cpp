#include "host/tools/camera_timing/global_shutter.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tagwrench {
namespace {

constexpr int kParameters = 5;
using Parameters = Eigen::Matrix<double, kParameters, 1>;  // latency (s), log jitter, log exposure,
                                                           // brightness without and by the light
constexpr double kNoise = 0.03;     // of the brightness; the response may bend a little
constexpr double kOutliers = 0.03;  // share of pictures of any brightness
constexpr double kReach = 4;        // standard deviations of the delay
constexpr double kLevel = 1e-6;     // slope of the brightness, per exposure
constexpr int kMinSteps = 40, kMaxSteps = 400;
constexpr double kStepsPerExposure = 20;

struct Moments {
  double likelihood = 0, time = 0, sigma = 0;
  double miss = 0;    ///< least difference of brightness, at any time near
  double chance = 0;  ///< share of the times near that have this brightness and no slope
};

class Likelihood {
 public:
  Likelihood(const CameraTimingInput& input, const LightSignal& light)
      : input_(input), light_(light) {
    for (const ObservedFrame& frame : input.frames) {
      double sum = 0, gains = 0;
      for (std::size_t b = 0; b < input.bands.size(); ++b) {
        sum += frame.rows[b] - input.dark[b];
        gains += input.lit[b] - input.dark[b];
      }
      brightness_.push_back(sum / gains);
    }
  }

  double minus_log(const Parameters& p) const {
    double sum = 0;
    for (std::size_t i = 0; i < brightness_.size(); ++i) sum -= std::log(of(i, p).likelihood);
    return sum;
  }

  Moments of(std::size_t picture, const Parameters& p) const {
    const double jitter = std::exp(p[1]), exposure = std::exp(p[2]);
    const double middle = input_.frames[picture].stamp - p[0];
    const int steps = std::clamp(
        static_cast<int>(2 * kReach * jitter / exposure * kStepsPerExposure), kMinSteps, kMaxSteps);
    double weights = 0, sum = 0, first = 0, second = 0, level = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < steps; ++k) {
      const double z = kReach * (2 * (k + 0.5) / steps - 1);
      const double off = z * jitter;
      const SeenLight seen = light_.seen({0.5, 0.5}, {middle + off, 0, exposure});
      const double miss = (brightness_[picture] - p[3] - p[4] * seen.mean) / kNoise;
      least = std::min(least, std::abs(miss));
      const double weight = std::exp(-0.5 * z * z);
      const double value = weight * std::exp(-0.5 * miss * miss);
      weights += weight;
      if (std::abs(seen.by_middle) * exposure < kLevel && std::abs(miss) < 1) level += weight;
      sum += value;
      first += value * off;
      second += value * off * off;
    }
    const double inlier = (1 - kOutliers) * sum / (weights * kNoise * 2.5066);
    Moments moments{inlier + kOutliers, middle, jitter, least * kNoise, level / weights};
    if (inlier > kOutliers) {
      moments.time = middle + first / sum;
      moments.sigma = std::sqrt(std::max(second / sum - std::pow(first / sum, 2), 0.0));
    }
    return moments;
  }

  double change(std::size_t picture) const {
    return picture > 0 ? brightness_[picture] - brightness_[picture - 1] : 0;
  }

 private:
  const CameraTimingInput& input_;
  const LightSignal& light_;
  std::vector<double> brightness_;  ///< 0 dark, 1 lit, about
};

/// Nelder and Mead's simplex.
Parameters lowest(const Likelihood& likelihood, const Parameters& start, const Parameters& step) {
  constexpr int kSteps = 400;
  struct Corner {
    Parameters at;
    double value;
  };
  std::array<Corner, kParameters + 1> corners;
  for (int i = 0; i <= kParameters; ++i) {
    Parameters at = start;
    if (i > 0) at[i - 1] += step[i - 1];
    corners[static_cast<std::size_t>(i)] = {at, likelihood.minus_log(at)};
  }
  const auto by_value = [](const Corner& a, const Corner& b) { return a.value < b.value; };
  for (int i = 0; i < kSteps; ++i) {
    std::sort(corners.begin(), corners.end(), by_value);
    if (corners.back().value - corners.front().value < 1e-5) break;
    Parameters centre = Parameters::Zero();
    for (int c = 0; c < kParameters; ++c) centre += corners[static_cast<std::size_t>(c)].at;
    centre /= kParameters;
    Corner& worst = corners.back();
    const auto along = [&](double way) -> Corner {
      const Parameters at = centre + way * (centre - worst.at);
      return {at, likelihood.minus_log(at)};
    };
    Corner tried = along(1);
    if (tried.value < corners.front().value) {
      const Corner further = along(2);
      if (further.value < tried.value) tried = further;
    } else if (tried.value >= corners[kParameters - 1].value) {
      tried = along(tried.value < worst.value ? 0.5 : -0.5);
    }
    if (tried.value < worst.value) {
      worst = tried;
      continue;
    }
    for (std::size_t c = 1; c < corners.size(); ++c) {
      corners[c].at = 0.5 * (corners[c].at + corners[0].at);
      corners[c].value = likelihood.minus_log(corners[c].at);
    }
  }
  return std::min_element(corners.begin(), corners.end(), by_value)->at;
}

/// Inverse of the second derivatives, or nothing where they are not those of a minimum.
bool covariance(const Likelihood& likelihood, const Parameters& at, const Parameters& step,
                Eigen::Matrix<double, kParameters, kParameters>& result) {
  Eigen::Matrix<double, kParameters, kParameters> curvature;
  const auto value = [&](int i, double di, int j, double dj) {
    Parameters p = at;
    p[i] += di * step[i];
    p[j] += dj * step[j];
    return likelihood.minus_log(p);
  };
  for (int i = 0; i < kParameters; ++i) {
    for (int j = 0; j <= i; ++j) {
      curvature(i, j) = curvature(j, i) =
          (value(i, 1, j, 1) - value(i, 1, j, -1) - value(i, -1, j, 1) + value(i, -1, j, -1)) /
          (4 * step[i] * step[j]);
    }
  }
  result = curvature.inverse();
  return result.allFinite() && result.diagonal().minCoeff() > 0;
}

}  // namespace

GlobalShutter fit_global_shutter(const CameraTimingInput& input, const LightSignal& light,
                                 const GlobalShutter& start) {
  const Likelihood likelihood(input, light);
  const Parameters wide(0.3 * input.bit, 0.5, 0.5, 0.03, 0.05);
  Parameters best(start.latency.value, std::log(start.jitter.value), std::log(start.exposure.value),
                  0, 1);
  best = lowest(likelihood, best, wide);
  best = lowest(likelihood, best, -0.3 * wide);  // from another side, where the first got stuck
  GlobalShutter out;
  out.latency.value = best[0];
  out.jitter.value = std::exp(best[1]);
  out.exposure.value = std::exp(best[2]);
  Eigen::Matrix<double, kParameters, kParameters> spread;
  const Parameters narrow(0.02 * input.bit, 0.05, 0.05, 0.005, 0.005);
  if (covariance(likelihood, best, narrow, spread)) {
    out.latency = {best[0], std::sqrt(spread(0, 0)), true};
    out.jitter.sigma = out.jitter.value * std::sqrt(spread(1, 1));
    out.exposure.sigma = out.exposure.value * std::sqrt(spread(2, 2));
    // A logarithm that is this uncertain says "small".
    constexpr double kVague = 0.5;
    out.jitter.known = std::sqrt(spread(1, 1)) < kVague;
    out.exposure.known = std::sqrt(spread(2, 2)) < kVague;
  }
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const Moments moments = likelihood.of(i, best);
    out.times.push_back(moments.time);
    out.sigmas.push_back(moments.sigma);
    out.misses.push_back(moments.miss);
    out.chances.push_back(moments.chance);
    out.changes.push_back(likelihood.change(i));
  }
  return out;
}

}  // namespace tagwrench
