#include "host/tools/camera_timing/camera_timing_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr double kFirstNoise = 0.05;    // of a band's gain, before it is known
constexpr double kMinNoise = 1e-4;      // of a band's gain
constexpr double kMinExposure = 50e-6;  // s
constexpr double kMaxInPeriods = 1.2;   // exposure and read-out
constexpr double kMinJitter = 20e-6;    // s
constexpr double kNoiseRatio = 0.75;    // from round to round, so that no picture is lost too early
constexpr int kRounds = 50;
constexpr double kSettled = 1e-8;  // s, of read-out and exposure
constexpr double kStrange = 8;     // times the median cost
// To be believed, one picture shown twice must fit better than two pictures by this much: one in
// fifty is stale to begin with.
constexpr double kRepeatMargin = 8;

}  // namespace

CameraTimingFit::CameraTimingFit(const CameraTimingInput& input)
    : input_(input),
      light_(input.edges),
      bands_(input.bands.size()),
      pictures_(input.frames.size()),
      dark_(input.dark),
      gain_(bands_),
      weight_(bands_),
      least_noise_(kFirstNoise) {
  for (std::size_t b = 0; b < bands_; ++b) {
    gain_[b] = input.lit[b] - input.dark[b];
    weight_[b] = 1 / std::pow(kFirstNoise * gain_[b], 2);
  }
  camera_.jitter = input.bit;
  camera_.exposure = input.bit;
}

double CameraTimingFit::cost(std::size_t picture, double time) const noexcept {
  const RowProfile& rows = input_.frames[picture].rows;
  const ExposureTimes exposure = times(time);
  double sum = 0;
  for (std::size_t b = 0; b < bands_; ++b) {
    const double off = rows[b] - dark_[b] - gain_[b] * light_.seen(input_.bands[b], exposure).mean;
    sum += weight_[b] * off * off;
  }
  return sum;
}

/// Late pictures come exponentially rarer, not as a Gaussian.
double CameraTimingFit::prior(std::size_t picture, double time) const noexcept {
  const double off = std::abs(time - expected(picture)) / camera_.jitter;
  return off < 1 ? off * off : 2 * off - 1;
}

/// Half of the prior's slope over the time's distance from what is expected.
double CameraTimingFit::prior_weight(std::size_t picture, double time) const noexcept {
  const double off = std::abs(time - expected(picture)) / camera_.jitter;
  return 1 / (camera_.jitter * camera_.jitter * std::max(off, 1.0));
}

/// Newton's way downhill from the picture's time, by no more than a bit.
void CameraTimingFit::settle(std::size_t picture) noexcept {
  constexpr int kSteps = 8;
  Picture& p = pictures_[picture];
  const RowProfile& rows = input_.frames[picture].rows;
  const double start = p.time;
  double value = cost(picture, p.time) + prior(picture, p.time);
  double information = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double weight = prior_weight(picture, p.time);
    double slope = weight * (expected(picture) - p.time);
    information = 0;
    for (std::size_t b = 0; b < bands_; ++b) {
      const SeenLight seen = light_.seen(input_.bands[b], times(p.time));
      const double by_time = gain_[b] * seen.by_middle;
      slope += weight_[b] * by_time * (rows[b] - dark_[b] - gain_[b] * seen.mean);
      information += weight_[b] * by_time * by_time;
    }
    double step = std::clamp(slope / (information + weight), -0.5 * input_.bit, 0.5 * input_.bit);
    bool better = false;
    for (int half = 0; half < 4 && !better; ++half, step *= 0.5) {
      const double time = std::clamp(p.time + step, start - input_.bit, start + input_.bit);
      const double tried = cost(picture, time) + prior(picture, time);
      if (tried >= value) continue;
      value = tried;
      p.time = time;
      better = true;
    }
    if (!better || std::abs(step) < 1e-9) break;
  }
  p.cost = cost(picture, p.time);
  p.sigma = information > 0 ? 1 / std::sqrt(information) : camera_.jitter;
}

void CameraTimingFit::refine() {
  guess_exposure();
  for (int round = 0; round < kRounds; ++round) {
    // While noise and delays are still being learned a better time may lie elsewhere.
    const bool afresh = round % 4 == 0;
    for (std::size_t i = 0; i < pictures_.size(); ++i) afresh ? search(i) : settle(i);
    judge();
    find_repeats();
    fit_delay();
    least_noise_ = std::max(kMinNoise, kNoiseRatio * least_noise_);
    fit_bands();
    if (step() < kSettled && !afresh && least_noise_ <= kMinNoise) break;
  }
  for (std::size_t i = 0; i < pictures_.size(); ++i) search(i);
  judge();
  find_repeats();
  fit_delay();
}

bool CameraTimingFit::rolls() const noexcept {
  constexpr double kMinFraction = 0.1;  // of a bit: less tells no more than a global shutter
  return std::abs(camera_.readout) > kMinFraction * input_.bit;
}

void CameraTimingFit::set_camera(const CameraTimes& camera) {
  camera_ = camera;
  for (std::size_t i = 0; i < pictures_.size(); ++i) search(i);
  fit_bands();
  for (std::size_t i = 0; i < pictures_.size(); ++i) search(i);
  judge();
  find_repeats();
}

/// Pictures that fit no time do not take part.
void CameraTimingFit::judge() noexcept {
  std::vector<double> costs;
  for (const Picture& p : pictures_) costs.push_back(p.cost);
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::nth_element(costs.begin(), middle, costs.end());
  const double most = kStrange * std::max(*middle, 0.2 * static_cast<double>(bands_));
  for (Picture& p : pictures_) p.good = p.cost < most;
}

/// A picture that fits its predecessor's time and none of its own is the predecessor's.
void CameraTimingFit::find_repeats() noexcept {
  for (std::size_t i = 1; i < pictures_.size(); ++i) {
    Picture& p = pictures_[i];
    const Picture& before = pictures_[i - 1];
    p.alone = true;
    if (!before.good) continue;
    const double repeated = cost(i, before.time);
    if (repeated + kRepeatMargin >= own_cost(i)) continue;
    p.alone = false;
    p.good = true;
    p.time = before.time;
    p.sigma = before.sigma;
    p.cost = repeated;
  }
}

/// Latency and jitter from the pictures that tell; jitter less the uncertainty of their times.
void CameraTimingFit::fit_delay() noexcept {
  double sum = 0, weights = 0;
  const auto tells = [&](const Picture& p) {
    return p.good && p.alone && p.sigma < 0.5 * input_.bit;
  };
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const Picture& p = pictures_[i];
    if (!tells(p)) continue;
    const double weight = 1 / (camera_.jitter * camera_.jitter + p.sigma * p.sigma);
    sum += weight * (input_.frames[i].stamp - p.time);
    weights += weight;
  }
  if (weights <= 0) return;
  camera_.latency = sum / weights;
  double squares = 0;
  int count = 0;
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const Picture& p = pictures_[i];
    if (!tells(p)) continue;
    // Posterior mean and variance of the delay under the prior of the last round.
    const double shrunk = 1 / (1 / (camera_.jitter * camera_.jitter) + 1 / (p.sigma * p.sigma));
    const double off = p.time - expected(i);
    squares += off * off + shrunk;
    ++count;
  }
  if (count > 3) camera_.jitter = std::max(kMinJitter, std::sqrt(squares / count));
}

/// Dark and gain of each band by a straight line through all pictures, and what scatters about it.
void CameraTimingFit::fit_bands() noexcept {
  for (std::size_t b = 0; b < bands_; ++b) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      if (!pictures_[i].good) continue;
      const double seen = light_.seen(input_.bands[b], times(pictures_[i].time)).mean;
      const double value = input_.frames[i].rows[b];
      n += 1;
      x += seen;
      y += value;
      xx += seen * seen;
      xy += seen * value;
      yy += value * value;
    }
    const double spread = n * xx - x * x;
    if (n < 4 || spread < 1e-3 * n * n) continue;
    const double gain = (n * xy - x * y) / spread;
    const double dark = (y - gain * x) / n;
    if (!(gain > 0.1 * gain_[b])) continue;
    gain_[b] = gain;
    dark_[b] = dark;
    const double squares = yy - dark * y - gain * xy;
    const double noise = std::max(std::sqrt(std::max(squares, 0.0) / (n - 2)), least_noise_ * gain);
    weight_[b] = 1 / (noise * noise);
  }
}

/// One Gauss-Newton step of read-out and exposure, the times of the pictures eliminated (Schur
/// complement) and each band's dark and gain projected out. Returns the step's length, s.
double CameraTimingFit::step() noexcept {
  struct Column {
    double n = 0, x = 0, xx = 0;
    Eigen::Vector2d d = Eigen::Vector2d::Zero(), xd = Eigen::Vector2d::Zero();
  };
  std::vector<Column> columns(bands_);
  const auto derivatives = [&](const SeenLight& seen, std::size_t b) -> Eigen::Vector2d {
    return gain_[b] * Eigen::Vector2d(seen.by_readout, seen.by_exposure);
  };
  for (std::size_t b = 0; b < bands_; ++b) {
    for (const Picture& p : pictures_) {
      if (!p.good) continue;
      const SeenLight seen = light_.seen(input_.bands[b], times(p.time));
      columns[b].n += 1;
      columns[b].x += seen.mean;
      columns[b].xx += seen.mean * seen.mean;
      columns[b].d += derivatives(seen, b);
      columns[b].xd += seen.mean * derivatives(seen, b);
    }
  }
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero(), scatter = information;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero(), follow = slope;
  int count = 0;
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const Picture& p = pictures_[i];
    if (!p.good) continue;
    Eigen::Matrix2d aa = Eigen::Matrix2d::Zero();
    Eigen::Vector2d at = Eigen::Vector2d::Zero(), ar = at;
    double tt = p.alone ? prior_weight(i, p.time) : 0;
    double tr = tt * (expected(i) - p.time);
    for (std::size_t b = 0; b < bands_; ++b) {
      const SeenLight seen = light_.seen(input_.bands[b], times(p.time));
      const Column& c = columns[b];
      const double spread = c.n * c.xx - c.x * c.x;
      Eigen::Vector2d a = derivatives(seen, b);
      if (spread > 1e-6 * c.n * c.n) {
        const Eigen::Vector2d by_gain = (c.n * c.xd - c.x * c.d) / spread;
        a -= by_gain * seen.mean + (c.d - by_gain * c.x) / c.n;
      }
      const double t = gain_[b] * seen.by_middle;
      const double r = input_.frames[i].rows[b] - dark_[b] - gain_[b] * seen.mean;
      aa += weight_[b] * a * a.transpose();
      at += weight_[b] * t * a;
      ar += weight_[b] * r * a;
      tt += weight_[b] * t * t;
      tr += weight_[b] * r * t;
    }
    if (!(tt > 0)) continue;
    const Eigen::Vector2d score = ar - at * (tr / tt);
    information += aa - at * at.transpose() / tt;
    scatter += score * score.transpose();
    slope += score;
    follow -= at / tt;
    ++count;
  }
  if (count == 0) return 0;
  // What the pictures cannot tell at all stays put.
  const Eigen::Matrix2d damped = information +
                                 1e-9 * information.trace() * Eigen::Matrix2d::Identity() +
                                 1e-12 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d inverse = damped.ldlt().solve(Eigen::Matrix2d::Identity());
  // Errors of one picture's bands go together: its scores' scatter says by how much more than their
  // number suggests.
  const Eigen::Matrix2d sandwich = inverse * scatter * inverse;
  covariance_ = sandwich.trace() > inverse.trace() ? sandwich : inverse;
  time_by_camera_ = follow / count;
  const Eigen::Vector2d change =
      (inverse * slope).cwiseMax(-0.5 * input_.bit).cwiseMin(0.5 * input_.bit);
  const CameraTimes before = camera_;
  const double longest = kMaxInPeriods * input_.period;
  camera_.readout = std::clamp(camera_.readout + change[0], -longest, longest);
  camera_.exposure = std::clamp(camera_.exposure + change[1], kMinExposure, longest);
  return std::max(std::abs(camera_.readout - before.readout),
                  std::abs(camera_.exposure - before.exposure));
}

}  // namespace tagwrench
