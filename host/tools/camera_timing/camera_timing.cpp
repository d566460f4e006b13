#include "host/tools/camera_timing/camera_timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host/tools/camera_timing/camera_timing_fit.h"
#include "host/tools/camera_timing/global_shutter.h"

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
  const auto frames = static_cast<int>(input.frames.size());
  if (frames < kMinBandwidthFrames) {
    return fmt::format(
        "only {} pictures came while the LED flashed, {} are needed: give it more time", frames,
        kMinBandwidthFrames);
  }
  if (input.bands.size() < 2 || input.edges.size() < 20)
    return "there is no pattern to compare with";
  return {};
}

double quantile(std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
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
        fit.cost(i, fit.pictures()[i - 1].time) - fit.own_cost(i) < kClear) {
      frame.freshness = Freshness::undecided;
    }
    if (frame.freshness == Freshness::strange) frame.exposed = fit.expected(i);
    result.times.push_back(frame);
  }
}

/// The median of the intervals between neighbours; lost frames are fewer than others.
double usual_interval(const std::vector<TimedFrame>& times, double fallback) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i].timed && times[i - 1].timed)
      intervals.push_back(times[i].exposed - times[i - 1].exposed);
  }
  if (intervals.empty()) return fallback;
  std::sort(intervals.begin(), intervals.end());
  return quantile(intervals, 0.5);
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
  double n = 0, w = 0, x = 0, y = 0, xx = 0, xy = 0;
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
    const auto number = static_cast<double>(frame.number);
    const double time = frame.exposed - start, weight = weight_of(frame);
    n += 1;
    w += weight;
    x += weight * number;
    y += weight * time;
    xx += weight * number * number;
    xy += weight * number * time;
    const double spread = w * xx - x * x;
    if (n >= kMinTimed && spread > 0) period = (w * xy - x * y) / spread;
  }
  if (n < kMinTimed) return;
  Line line;
  for (const TimedFrame& frame : result.times) {
    if (usable(frame))
      line.add(static_cast<double>(frame.number), frame.exposed - start, weight_of(frame));
  }
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

void count_frames(const CameraTimingInput& input, CameraTimingResult& result);

/// Pictures of a global shutter tell their times only together.
void measure_global_shutter(const CameraTimingInput& input, CameraTimingFit& fit,
                            CameraTimingResult& result) {
  GlobalShutter start;
  start.latency.value = fit.camera().latency;
  start.jitter.value = fit.camera().jitter;
  start.exposure.value = fit.camera().exposure;
  const GlobalShutter found = fit_global_shutter(input, fit.light(), start);
  const double finest = kFinestTime * found.exposure.value;
  fit.set_camera(
      {found.latency.value, std::max(found.jitter.value, finest), 0, found.exposure.value});
  copy_times(input, fit, result);
  bool was_vague = false;
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    TimedFrame& frame = result.times[i];
    // The same brightness as the picture before may be that of the next time the light stood still.
    const bool chance = frame.freshness == Freshness::stale && found.chances[i] > kByChance;
    if (chance) frame.freshness = Freshness::undecided;
    if (frame.freshness == Freshness::stale) continue;
    // One brightness near the pattern's least or most may fit no time to within the noise, for the
    // exposure's error alone: then the stamp tells, and whether it is stale only the change does.
    const bool vague = frame.freshness == Freshness::strange;
    if (vague && found.misses[i] < kOffBrightness) frame.freshness = Freshness::fresh;
    if (i > 0 && (vague || was_vague) && frame.freshness == Freshness::fresh &&
        std::abs(found.changes[i]) < kSameBrightness) {
      frame.freshness = Freshness::undecided;
    }
    was_vague = vague;
    frame.exposed = found.times[i];
    frame.sigma = found.sigmas[i];
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

}  // namespace

double CameraTimingResult::new_pictures_rate() const noexcept {
  return elapsed > 0 ? (frames - 1 - stale) / elapsed : 0;
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
