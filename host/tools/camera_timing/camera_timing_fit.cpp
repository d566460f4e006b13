#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/core/robust_statistics.h"
#include "host/tools/camera_timing/camera_timing.h"

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

constexpr std::size_t kGroups = 12;  // of bands
constexpr double kStepsPerBit = 4;   // of the latency's grid
constexpr double kReadoutStepsPerBit = 3;
// Of the correlation, over its standard deviation 1/sqrt(frames) where there is none: a hundred
// thousand tries reach 4.5.
constexpr double kMinSignificance = 6;

constexpr std::array<double, 5> kJitters = {0.1, 0.2, 0.4, 0.8, 1.6};  // bits

struct Group {
  double place = 0;            ///< share of the picture's height, less 1/2
  std::vector<double> values;  ///< per frame, mean 0, sum of squares 1
};

void standardise(std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (double& v : values) {
    v -= mean;
    squares += v * v;
  }
  const double scale = squares > 1e-12 ? 1 / std::sqrt(squares) : 0;
  for (double& v : values) v *= scale;
}

std::vector<Group> make_groups(const CameraTimingInput& input) {
  const std::size_t count = std::min(kGroups, input.bands.size());
  std::vector<Group> groups(count);
  for (std::size_t g = 0; g < count; ++g) {
    const std::size_t first = g * input.bands.size() / count;
    const std::size_t last = (g + 1) * input.bands.size() / count;
    Group& group = groups[g];
    group.values.assign(input.frames.size(), 0);
    for (std::size_t b = first; b < last; ++b) {
      const double middle = 0.5 * (input.bands[b].first + input.bands[b].last);
      group.place += (middle - 0.5) / static_cast<double>(last - first);
      for (std::size_t i = 0; i < input.frames.size(); ++i)
        group.values[i] += input.frames[i].rows[b];
    }
    standardise(group.values);
  }
  return groups;
}

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
  const double most =
      kStrange * std::max(median(std::move(costs)), 0.2 * static_cast<double>(bands_));
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
    LineSums line;
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      if (!pictures_[i].good) continue;
      line.add(light_.seen(input_.bands[b], times(pictures_[i].time)).mean,
               input_.frames[i].rows[b]);
    }
    if (line.n < 4 || line.spread() < 1e-3 * line.n * line.n) continue;
    const double gain = line.slope(), dark = line.offset();
    if (!(gain > 0.1 * gain_[b])) continue;
    gain_[b] = gain;
    dark_[b] = dark;
    const double squares = line.yy - dark * line.y - gain * line.xy;
    const double noise =
        std::max(std::sqrt(std::max(squares, 0.0) / (line.n - 2)), least_noise_ * gain);
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

// Each group of bands alone is correlated with the light over a range of delays; the read-out is
// what lines the groups' peaks up.
bool CameraTimingFit::find() {
  const double delay_step = input_.bit / kStepsPerBit;
  const double least_delay = -input_.period;
  const auto delays = static_cast<std::size_t>((kMaxLatency + 2 * input_.period) / delay_step) + 1;
  const std::vector<Group> groups = make_groups(input_);
  std::vector<std::vector<double>> correlation(groups.size(), std::vector<double>(delays));
  std::vector<double> light(input_.frames.size());
  for (std::size_t k = 0; k < delays; ++k) {
    const double delay = least_delay + static_cast<double>(k) * delay_step;
    for (std::size_t i = 0; i < light.size(); ++i)
      light[i] = light_.seen({0.5, 0.5}, {input_.frames[i].stamp - delay, 0, input_.bit}).mean;
    standardise(light);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      double sum = 0;
      for (std::size_t i = 0; i < light.size(); ++i) sum += light[i] * groups[g].values[i];
      correlation[g][k] = sum;
    }
  }
  double best = -1;
  const double readout_step = input_.bit / kReadoutStepsPerBit;
  const auto most = static_cast<int>(input_.period / readout_step);
  for (int r = -most; r <= most; ++r) {
    const double readout = r * readout_step;
    for (double latency = 0; latency <= kMaxLatency; latency += delay_step) {
      double sum = 0;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        const double delay = latency - groups[g].place * readout;
        const auto k = static_cast<std::size_t>(std::clamp((delay - least_delay) / delay_step + 0.5,
                                                           0.0, static_cast<double>(delays - 1)));
        sum += correlation[g][k];
      }
      sum /= static_cast<double>(groups.size());
      // Of a tie (a global shutter) the shortest read-out.
      if (sum > best + 1e-9 ||
          (sum > best - 1e-9 && std::abs(readout) < std::abs(camera_.readout))) {
        best = sum;
        camera_.latency = latency;
        camera_.readout = readout;
      }
    }
  }
  return best * std::sqrt(static_cast<double>(input_.frames.size())) > kMinSignificance;
}

// The pair under which the pictures are likeliest, whenever exactly each was taken. (Were the best
// time of each picture taken instead, a global shutter's single brightness would fit any exposure.)
void CameraTimingFit::guess_exposure() {
  constexpr std::size_t kMaxPictures = 80;
  constexpr double kExposureRatio = 1.35, kReach = 3, kStepsPerBit = 24;  // bits
  constexpr double kOutlier = 1e-9;  // likelihood of a picture that fits no time
  const std::size_t every = pictures_.size() / kMaxPictures + 1;
  const auto steps = static_cast<int>(2 * kReach * kStepsPerBit);
  double best = -std::numeric_limits<double>::infinity();
  CameraTimes chosen = camera_;
  std::vector<double> likelihood(static_cast<std::size_t>(steps));
  for (double exposure = input_.bit / 12; exposure < input_.period; exposure *= kExposureRatio) {
    camera_.exposure = exposure;
    std::array<double, kJitters.size()> sums{};
    for (std::size_t i = 0; i < pictures_.size(); i += every) {
      for (int k = 0; k < steps; ++k) {
        const double off = ((k + 0.5) / kStepsPerBit - kReach) * input_.bit;
        likelihood[k] = std::exp(-0.5 * cost(i, expected(i) + off));
      }
      for (std::size_t j = 0; j < kJitters.size(); ++j) {
        double sum = 0;
        for (int k = 0; k < steps; ++k) {
          const double off = ((k + 0.5) / kStepsPerBit - kReach) / kJitters[j];
          sum += likelihood[k] * std::exp(-0.5 * off * off);
        }
        sums[j] += std::log(sum / kJitters[j] + kOutlier);
      }
    }
    for (std::size_t j = 0; j < kJitters.size(); ++j) {
      if (sums[j] <= best) continue;
      best = sums[j];
      chosen.exposure = exposure;
      chosen.jitter = kJitters[j] * input_.bit;
    }
  }
  camera_ = chosen;
}

// Every time that the stamp may mean, in steps of a fraction of a bit, then downhill in the deepest
// valleys: a picture's bits may well come again some bits away, and only the stamp can tell.
void CameraTimingFit::search(std::size_t picture) noexcept {
  constexpr double kStepsPerExposure = 2, kMinStepsPerBit = 5, kMaxStepsPerBit = 15;
  constexpr double kReach = 0.45;  // of the frame period
  constexpr double kApart = 0.75;  // of a bit: valleys nearer than this are one
  const double step = std::clamp(camera_.exposure / kStepsPerExposure, input_.bit / kMaxStepsPerBit,
                                 input_.bit / kMinStepsPerBit);
  const auto total = [&](double time) { return cost(picture, time) + prior(picture, time); };
  struct Valley {
    double time = 0, total = std::numeric_limits<double>::infinity();
  };
  const auto deeper = [](const Valley& a, const Valley& b) { return a.total > b.total; };
  std::array<Valley, 6> deepest;  // shallowest first
  const double first = expected(picture) - kReach * input_.period;
  const auto steps = static_cast<int>(2 * kReach * input_.period / step);
  double before = std::numeric_limits<double>::infinity(), here = total(first);
  for (int k = 0; k < steps; ++k) {
    const double after = total(first + (k + 1) * step);
    if (here <= before && here < after && here < deepest.front().total) {
      deepest.front() = {first + k * step, here};
      std::sort(deepest.begin(), deepest.end(), deeper);
    }
    before = here;
    here = after;
  }
  Picture& p = pictures_[picture];
  for (Valley& valley : deepest) {
    if (!std::isfinite(valley.total)) continue;
    p.time = valley.time;
    settle(picture);
    valley = {p.time, total(p.time)};
  }
  std::sort(deepest.begin(), deepest.end(), deeper);
  const Valley& best = deepest.back();
  p.time = best.time;
  settle(picture);
  p.margin = std::numeric_limits<double>::infinity();
  for (const Valley& valley : deepest)
    if (std::abs(valley.time - best.time) > kApart * input_.bit)
      p.margin = std::min(p.margin, valley.total - best.total);
}

}  // namespace tagwrench
