// First guesses: where in the pattern the pictures are, by correlation.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/tools/camera_timing/camera_timing_fit.h"

namespace tagwrench {
namespace {

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
        likelihood[static_cast<std::size_t>(k)] = std::exp(-0.5 * cost(i, expected(i) + off));
      }
      for (std::size_t j = 0; j < kJitters.size(); ++j) {
        double sum = 0;
        for (int k = 0; k < steps; ++k) {
          const double off = ((k + 0.5) / kStepsPerBit - kReach) / kJitters[j];
          sum += likelihood[static_cast<std::size_t>(k)] * std::exp(-0.5 * off * off);
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
  std::array<Valley, 6> deepest;  // shallowest first
  const double first = expected(picture) - kReach * input_.period;
  const auto steps = static_cast<int>(2 * kReach * input_.period / step);
  double before = std::numeric_limits<double>::infinity(), here = total(first);
  for (int k = 0; k < steps; ++k) {
    const double after = total(first + (k + 1) * step);
    if (here <= before && here < after && here < deepest.front().total) {
      deepest.front() = {first + k * step, here};
      std::sort(deepest.begin(), deepest.end(),
                [](const Valley& a, const Valley& b) { return a.total > b.total; });
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
  std::sort(deepest.begin(), deepest.end(),
            [](const Valley& a, const Valley& b) { return a.total > b.total; });
  const Valley& best = deepest.back();
  p.time = best.time;
  settle(picture);
  p.margin = std::numeric_limits<double>::infinity();
  for (const Valley& valley : deepest) {
    if (std::abs(valley.time - best.time) > kApart * input_.bit)
      p.margin = std::min(p.margin, valley.total - best.total);
  }
}

}  // namespace tagwrench
