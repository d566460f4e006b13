#include "host/tools/camera_timing/camera_timing.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "host/core/robust_statistics.h"

namespace tagwrench {
namespace {

constexpr double kBitsPerFrame = 15.382;  // no fraction of small numbers comes near
constexpr int kMinTimed = 8;
constexpr double kTellsTime = 0.25;       // of a bit
constexpr double kClear = 9;              // difference of costs: three standard deviations
constexpr double kGoodShutter = 3;        // standard deviations
constexpr double kModel = 0.15e-6;        // s, that bands of rows leave out of the shutter's times
constexpr double kFinestTime = 0.03;      // of the exposure, that a brightness tells at best
constexpr double kShape = 0.35;           // of the jitter
constexpr double kGlobalReadout = 0.05;   // of a bit: what a read-out of 0 may be
constexpr double kOffBrightness = 0.1;    // of the LED's light: more is another light's
constexpr double kByChance = 0.01;        // share of the times near: less is rarer than stale ones
constexpr double kSameBrightness = 0.02;  // of the LED's light: less may be a stale picture's

std::string unusable(const CameraTimingInput& input) {
  if (input.frames.size() < kMinBandwidthFrames) {
    return fmt::format(
        "only {} pictures came while the LED flashed, {} are needed: give it more time",
        input.frames.size(), kMinBandwidthFrames);
  }
  if (input.bands.size() < 2 || input.edges.size() < 20)
    return "there is no pattern to compare with";
  return {};
}

void copy_times(const CameraTimingInput& input, const CameraTimingFit& fit,
                CameraTimingResult& result) {
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const CameraTimingFit::Picture& p = fit.pictures()[i];
    TimedFrame frame;
    frame.exposed = p.time;
    frame.sigma = p.sigma;
    frame.timed = p.good && p.alone && p.sigma < kTellsTime * input.bit && p.margin > kClear;
    frame.freshness = !p.alone ? Freshness::stale : p.good ? Freshness::fresh : Freshness::strange;
    if (i > 0 && frame.freshness == Freshness::fresh &&
        fit.cost(i, fit.pictures()[i - 1].time) - fit.own_cost(i) < kClear)
      frame.freshness = Freshness::undecided;
    if (frame.freshness == Freshness::strange) frame.exposed = fit.expected(i);
    result.times.push_back(frame);
  }
}

/// The median of the intervals between neighbours; lost frames are fewer than others.
double usual_interval(const std::vector<TimedFrame>& times, double fallback) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i].timed && times[i - 1].timed)
      intervals.push_back(times[i].exposed - times[i - 1].exposed);
  return intervals.empty() ? fallback : median(std::move(intervals));
}

/// A straight line through points of which some are off by more than their weights say: each counts
/// with a variance of its own and one of all points, found such that the residuals fit (Paule and
/// Mandel), and those far off count less (Huber).
class Line {
 public:
  void add(double x, double y, double weight) { points_.push_back({x, y, 1 / weight, 0}); }

  /// False if there are too few points, or all at one place.
  bool fit() {
    constexpr int kRounds = 60;
    if (points_.size() < 3 || !solve(0)) return false;
    double low = 0, high = 0;
    for (const Point& p : points_) high = std::max(high, off(p) * off(p) + p.variance);
    if (excess() > 1) {
      for (int i = 0; i < kRounds; ++i) {
        const double middle = 0.5 * (low + high);
        if (!solve(middle)) return false;
        (excess() > 1 ? low : high) = middle;
      }
      if (!solve(high)) return false;
    }
    return true;
  }

  double slope() const noexcept { return slope_; }
  double slope_sigma() const noexcept { return slope_sigma_; }

 private:
  struct Point {
    double x, y, variance, weight;
  };
  double off(const Point& p) const noexcept { return p.y - offset_ - slope_ * p.x; }

  double excess() const noexcept {
    double squares = 0;
    for (const Point& p : points_) squares += p.weight * off(p) * off(p);
    return squares / (static_cast<double>(points_.size()) - 2);
  }

  bool solve(double common) {
    constexpr int kRounds = 10;
    constexpr double kHuber = 2;  // standard deviations
    for (Point& p : points_) p.weight = 1 / (p.variance + common);
    for (int i = 0; i < kRounds; ++i) {
      double w = 0, x = 0, y = 0, xx = 0, xy = 0;
      for (const Point& p : points_) {
        w += p.weight;
        x += p.weight * p.x;
        y += p.weight * p.y;
      }
      x /= w;
      y /= w;
      for (const Point& p : points_) {
        xx += p.weight * (p.x - x) * (p.x - x);
        xy += p.weight * (p.x - x) * (p.y - y);
      }
      if (!(xx > 0)) return false;
      slope_ = xy / xx;
      offset_ = y - slope_ * x;
      // The scatter of the points themselves, wherever along the line they lie (White).
      double scatter = 0;
      for (const Point& p : points_) scatter += std::pow(p.weight * (p.x - x) * off(p), 2);
      const auto n = static_cast<double>(points_.size());
      slope_sigma_ = std::sqrt(std::max(scatter * n / (n - 2) / (xx * xx), 1 / xx));
      for (Point& p : points_) {
        const double z = std::abs(off(p)) / std::sqrt(p.variance + common);
        p.weight = std::min(1.0, kHuber / std::max(z, kHuber)) / (p.variance + common);
      }
    }
    return true;
  }

  std::vector<Point> points_;
  double slope_ = 0, offset_ = 0, slope_sigma_ = 0;
};

/// Numbers the exposures, and fits a straight line through their times. Pictures that are not timed
/// count as their sigmas say, if `all`, or not at all.
void fit_rate(const CameraTimingInput& input, bool all, CameraTimingResult& result) {
  constexpr double kFinest = 1e-7;  // s, no time is better known
  double period = usual_interval(result.times, input.period);
  // Neighbours give the period to a few parts in a thousand, and the longer the stretch that is
  // numbered, the better it is known.
  LineSums sums;
  const TimedFrame* last = nullptr;
  const double start = result.times.front().exposed;
  const auto usable = [all](const TimedFrame& frame) {
    return frame.timed || (all && frame.freshness == Freshness::fresh);
  };
  const auto weight_of = [](const TimedFrame& frame) {
    return 1 / (frame.sigma * frame.sigma + kFinest * kFinest);
  };
  for (TimedFrame& frame : result.times) {
    if (last != nullptr)
      frame.number = last->number + std::llround((frame.exposed - last->exposed) / period);
    if (!usable(frame)) continue;
    last = &frame;
    sums.add(static_cast<double>(frame.number), frame.exposed - start, weight_of(frame));
    if (sums.n >= kMinTimed && sums.spread() > 0) period = sums.slope();
  }
  if (sums.n < kMinTimed) return;
  Line line;
  for (const TimedFrame& frame : result.times)
    if (usable(frame))
      line.add(static_cast<double>(frame.number), frame.exposed - start, weight_of(frame));
  if (!line.fit()) return;
  result.frame_rate = {
      1 / line.slope(),
      std::hypot(line.slope_sigma() / line.slope(), input.clock_rate_sigma) / line.slope(), true};
}

/// A straight exponential's scatter of a standard deviation is larger than a normal's; so the
/// fourth moment is measured too.
void fit_latency(const CameraTimingInput& input, const CameraTimingFit& fit,
                 CameraTimingResult& result) {
  std::vector<double> delays;
  double noise = 0;
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    if (!result.times[i].timed) continue;
    delays.push_back(input.frames[i].stamp - result.times[i].exposed);
    noise += result.times[i].sigma * result.times[i].sigma;
  }
  result.timed = static_cast<int>(delays.size());
  if (result.timed < kMinTimed) return;
  const auto count = static_cast<double>(delays.size());
  double mean = 0, second = 0, fourth = 0;
  for (const double d : delays) mean += d / count;
  for (const double d : delays) {
    second += std::pow(d - mean, 2) / count;
    fourth += std::pow(d - mean, 4) / count;
  }
  const double variance = second * count / (count - 1);
  const double common = fit.time_by_camera().dot(fit.covariance() * fit.time_by_camera());
  result.latency = {
      mean, std::sqrt(variance / count + std::max(common, 0.0) + std::pow(input.edge_sigma, 2)),
      true};
  const double own = std::max(variance - noise / count, 0.0);
  const double variance_sigma = std::sqrt(std::max(fourth - second * second, 0.0) / count);
  const double jitter = std::sqrt(own);
  result.jitter = {jitter, variance_sigma / (2 * std::max(jitter, std::sqrt(noise / count))), true};
  std::sort(delays.begin(), delays.end());
  result.latency_least = delays.front();
  result.latency_median = quantile(delays, 0.5);
  result.latency_95 = quantile(delays, 0.95);
  result.latency_most = delays.back();
}

void count_frames(const CameraTimingInput& input, CameraTimingResult& result) {
  result.frames = static_cast<int>(result.times.size());
  std::set<std::int64_t> seen;
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    const TimedFrame& frame = result.times[i];
    result.stale += frame.freshness == Freshness::stale ? 1 : 0;
    result.undecided += frame.freshness == Freshness::undecided ? 1 : 0;
    result.strange += frame.freshness == Freshness::strange ? 1 : 0;
    if (frame.freshness != Freshness::stale) seen.insert(frame.number);
    if (i > 0) result.dropped_by_driver += static_cast<int>(input.frames[i].dropped);
  }
  if (!seen.empty()) {
    result.missing = static_cast<int>(*seen.rbegin() - *seen.begin() + 1 -
                                      static_cast<std::int64_t>(seen.size()));
  }
  result.elapsed = input.frames.back().stamp - input.frames.front().stamp;
}

// A global shutter's picture has one brightness, which fits many times: nothing but all pictures
// together, and their stamps, tell latency, jitter and exposure.

/// What a picture's brightness and stamp tell of it.
struct Moments {
  double likelihood = 0;
  double time = 0;   ///< middle of the exposure, host clock, s
  double sigma = 0;  ///< s, of stamp and picture together
  double miss =
      0;  ///< least difference of brightness from the light at any time near; 0 dark, 1 lit
  double chance = 0;  ///< share of the times near that have this brightness and no slope: a picture
                      ///< before it may have the same by chance
  double change = 0;  ///< of brightness since the picture before; 0 for the first
};

struct GlobalShutter {
  Figure latency, jitter, exposure;  ///< s; less the uncertainty of the clocks
  std::vector<Moments> pictures;
};

constexpr int kParameters = 5;
using Parameters = Eigen::Matrix<double, kParameters, 1>;  // latency (s), log jitter, log exposure,
                                                           // brightness without and by the light
constexpr double kNoise = 0.03;     // of the brightness; the response may bend a little
constexpr double kOutliers = 0.03;  // share of pictures of any brightness
constexpr double kReach = 4;        // standard deviations of the delay
constexpr double kLevel = 1e-6;     // slope of the brightness, per exposure
constexpr int kMinSteps = 40, kMaxSteps = 400;
constexpr double kStepsPerExposure = 20;

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
    const double change = picture > 0 ? brightness_[picture] - brightness_[picture - 1] : 0;
    Moments moments{inlier + kOutliers, middle, jitter, least * kNoise, level / weights, change};
    if (inlier > kOutliers) {
      moments.time = middle + first / sum;
      moments.sigma = std::sqrt(std::max(second / sum - std::pow(first / sum, 2), 0.0));
    }
    return moments;
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
    corners[i] = {at, likelihood.minus_log(at)};
  }
  const auto by_value = [](const Corner& a, const Corner& b) { return a.value < b.value; };
  for (int i = 0; i < kSteps; ++i) {
    std::sort(corners.begin(), corners.end(), by_value);
    if (corners.back().value - corners.front().value < 1e-5) break;
    Parameters centre = Parameters::Zero();
    for (int c = 0; c < kParameters; ++c) centre += corners[c].at;
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

/// Greatest likelihood, each picture's time integrated out: its delay normal about the latency, its
/// brightness that of the light at that time, but for a few outliers (stale ones). `start` is where
/// to look: latency to half a bit, jitter and exposure to a factor of two.
GlobalShutter fit_global_shutter(const CameraTimingInput& input, const LightSignal& light,
                                 const CameraTimes& start) {
  const Likelihood likelihood(input, light);
  const Parameters wide(0.3 * input.bit, 0.5, 0.5, 0.03, 0.05);
  Parameters best(start.latency, std::log(start.jitter), std::log(start.exposure), 0, 1);
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
  for (std::size_t i = 0; i < input.frames.size(); ++i)
    out.pictures.push_back(likelihood.of(i, best));
  return out;
}

/// Pictures of a global shutter tell their times only together.
void measure_global_shutter(const CameraTimingInput& input, CameraTimingFit& fit,
                            CameraTimingResult& result) {
  const GlobalShutter found = fit_global_shutter(input, fit.light(), fit.camera());
  const double finest = kFinestTime * found.exposure.value;
  fit.set_camera(
      {found.latency.value, std::max(found.jitter.value, finest), 0, found.exposure.value});
  copy_times(input, fit, result);
  bool was_vague = false;
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    TimedFrame& frame = result.times[i];
    const Moments& picture = found.pictures[i];
    // The same brightness as the picture before may be that of the next time the light stood still.
    const bool chance = frame.freshness == Freshness::stale && picture.chance > kByChance;
    if (chance) frame.freshness = Freshness::undecided;
    if (frame.freshness == Freshness::stale) continue;
    // One brightness near the pattern's least or most may fit no time to within the noise, for the
    // exposure's error alone: then the stamp tells, and whether it is stale only the change does.
    const bool vague = frame.freshness == Freshness::strange;
    if (vague && picture.miss < kOffBrightness) frame.freshness = Freshness::fresh;
    if (i > 0 && (vague || was_vague) && frame.freshness == Freshness::fresh &&
        std::abs(picture.change) < kSameBrightness)
      frame.freshness = Freshness::undecided;
    was_vague = vague;
    frame.exposed = picture.time;
    frame.sigma = picture.sigma;
    frame.timed = !vague && !chance && frame.sigma < kTellsTime * input.bit;
  }
  fit_rate(input, true, result);
  fit_latency(input, fit, result);
  count_frames(input, result);
  result.latency = found.latency;
  // What the delays' distribution looks like, a normal one or one with a long tail, cannot be seen.
  const double shape = kShape * found.jitter.value;
  result.latency.sigma = std::sqrt(std::pow(found.latency.sigma, 2) + std::pow(shape, 2) +
                                   std::pow(input.edge_sigma, 2));
  result.jitter = found.jitter;
  result.jitter.sigma = std::hypot(found.jitter.sigma, shape);
  result.exposure = found.exposure;
  result.exposure.sigma = std::hypot(found.exposure.sigma, shape);
  result.readout = {0, kGlobalReadout * input.bit, true};
}

}  // namespace

double quantile(const std::vector<double>& ascending, double share) {
  if (ascending.empty()) return 0;
  return ascending[static_cast<std::size_t>(share * static_cast<double>(ascending.size() - 1) +
                                            0.5)];
}

double bit_period_for(double frame_period) { return frame_period / kBitsPerFrame; }

CameraTimingResult measure_camera_timing(const CameraTimingInput& input) {
  CameraTimingResult result;
  result.refusal = unusable(input);
  if (!result.refusal.empty()) return result;
  CameraTimingFit fit(input);
  if (!fit.find()) {
    result.refusal = fmt::format(
        "the pictures do not show the LED's pattern within {:.0f} ms: is another light flickering, "
        "or are their times far off?",
        1e3 * kMaxLatency);
    return result;
  }
  fit.refine();
  if (!fit.rolls()) {
    measure_global_shutter(input, fit, result);
    return result;
  }
  copy_times(input, fit, result);
  fit_rate(input, false, result);
  fit_latency(input, fit, result);
  count_frames(input, result);
  const Eigen::Vector2d sigma = fit.covariance().diagonal().cwiseMax(0).cwiseSqrt();
  result.readout = {fit.camera().readout, std::hypot(sigma[0], kModel),
                    sigma[0] < kGoodShutter * input.bit};
  result.exposure = {fit.camera().exposure, std::hypot(sigma[1], kModel),
                     sigma[1] < kGoodShutter * input.bit};
  return result;
}

}  // namespace tagwrench
