#include "host/wrench/zero.h"

#include <array>
#include <cmath>

#include "host/wrench/estimate.h"

namespace tagwrench {
namespace {

/// Scatter that counts as noise whatever is said of the noise, and that never does, of the range.
constexpr double kMinScatter = 1e-4;
constexpr double kMaxScatter = 3e-3;

bool known(double range) { return range > 0 && range < kUnknownRange; }

Vector6 known_fraction(Vector6 range) {
  for (int i = 0; i < 6; ++i)
    if (!known(range[i])) range[i] = 0;
  return range;
}

StationarityDetector::Options scatter(const Vector6& range) {
  StationarityDetector::Options options;
  options.least = range * kMinScatter;
  options.most = range * kMaxScatter;
  for (int i = 0; i < 6; ++i)
    if (range[i] == 0) options.least[i] = options.most[i] = 1e150;  // not looked at
  return options;
}

double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

void StationarityDetector::add(TimePoint time, const Vector6& value,
                               const Vector6& sigma) noexcept {
  if (!started_ || time <= last_ || time - last_ > options_.longest_gap) {
    started_ = true;
    moves_ = false;
    last_ = calm_since_ = time;
    mean_ = value;
    variance_.setZero();
    return;
  }
  // West, "Updating mean and variance estimates", CACM 22(9), 1979, with a forgetting weight.
  const double weight = 1 - std::exp(-seconds(time - last_) / seconds(options_.memory));
  const Vector6 from_mean = value - mean_;
  mean_ += weight * from_mean;
  variance_ = (1 - weight) * (variance_ + weight * from_mean.cwiseAbs2());
  last_ = time;
  const Vector6 limit = (options_.sigmas * sigma).cwiseMax(options_.least).cwiseMin(options_.most);
  moves_ = !(variance_.array() <= limit.array().square()).all();
  if (moves_) calm_since_ = time;
}

ZeroTracking::ZeroTracking(const ZeroOptions& options)
    : options_(options),
      range_(known_fraction(options.range)),
      follow_(options.follow && range_.maxCoeff() > 0),
      meter_(scatter(range_)) {}

bool ZeroTracking::within(const Vector6& wrench, double part) const noexcept {
  for (int i = 0; i < 6; ++i)
    if (range_[i] > 0 && !(std::abs(wrench[i]) <= part * range_[i])) return false;
  return true;
}

ZeroState ZeroTracking::judge(const Sample& sample, const Vector6& noise) noexcept {
  if (!carries_numbers(sample.status)) {
    meter_.reset();
    return ZeroState::touched;
  }
  meter_.add(sample.capture_time, sample.wrench, noise);
  if (sample.touched || sample.status == Status::saturated) meter_.reset();
  const bool hand = sample.touched || meter_.moves();
  felt_ = felt_ || hand || !within(reading(), options_.band);
  if (hand || !meter_.still()) return ZeroState::touched;
  return within(reading(), felt_ ? options_.capture : options_.band) ? ZeroState::following
                                                                     : ZeroState::far;
}

/// A hand is felt by what scatters: who merely rests his hand on the sensor does not get a zero.
void ZeroTracking::answer(const Sample& sample) noexcept {
  const bool just_asked = !asked_at_;
  if (just_asked) asked_at_ = sample.capture_time;
  const bool at_rest =
      sample.zero_state == ZeroState::following || sample.zero_state == ZeroState::far;
  if (!(range_.maxCoeff() > 0)) {
    answer_ = ZeroAnswer::no_range;
  } else if (at_rest && within(reading(), asked_ ? options_.reach : options_.band)) {
    if (asked_) {
      options_.set += reading();
    } else {
      const Vector6 limit = options_.band * range_;
      const Vector6 before = moved_;
      moved_ = (moved_ + reading()).cwiseMin(limit).cwiseMax(-limit).eval();
      taken_awake_ = moved_ - before;
    }
    answer_ = ZeroAnswer::done;
  } else if (sample.capture_time - *asked_at_ >= options_.patience) {
    answer_ = at_rest ? ZeroAnswer::loaded : ZeroAnswer::moving;
  } else {
    if (just_asked && asked_) answer_ = ZeroAnswer::waits;
    return;
  }
  if (!asked_ && answer_ != ZeroAnswer::done) answer_ = ZeroAnswer::none;
  asked_ = woke_ = false;
  asked_at_.reset();
}

void ZeroTracking::follow(Sample& sample, const Vector6& noise) noexcept {
  sample.zero_state = judge(sample, noise);
  if (asked_ || woke_) answer(sample);
  if (taken_awake_ && sample.zero_state == ZeroState::far &&
      within(reading() + *taken_awake_, options_.capture)) {
    moved_ -= *taken_awake_;
    taken_awake_.reset();
  }
  if (!follow_) sample.zero_state = ZeroState::off;
  if (sample.zero_state == ZeroState::following) {
    const double dt = seconds(sample.capture_time - last_);
    const double weight = 1 - std::exp(-dt / options_.time_constant);
    const Vector6 step = options_.rate * dt * range_;
    const Vector6 limit = options_.band * range_;
    moved_ += (weight * reading()).cwiseMin(step).cwiseMax(-step);
    moved_ = moved_.cwiseMin(limit).cwiseMax(-limit).eval();
  }
  last_ = sample.capture_time;
  sample.zero = options_.set + moved_;
  if (carries_numbers(sample.status)) sample.wrench -= sample.zero;
}

Vector6 range_through(const Matrix6& tool, const Vector6& range) {
  Vector6 felt = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      if (std::abs(tool(i, j)) < 1e-12) continue;
      if (!known(range[j])) {
        felt[i] = 0;
        break;
      }
      felt[i] += std::abs(tool(i, j)) * range[j];
    }
  }
  return felt;
}

Vector6 range_along(const Eigen::Matrix3d& turn, const Vector6& range) {
  return range_through(wrench_transform(turn, Eigen::Vector3d::Zero()), range);
}

std::string_view zero_text(ZeroAnswer answer) noexcept {
  constexpr std::array<std::string_view, 6> kTexts{
      "",
      "zero: waits until the platform rests; hands off",
      "zero: what read is nothing now",
      "zero: refused, something presses on the platform; take it off, or run `tagwrench zero`",
      "zero: refused, the platform did not come to rest; let go of it",
      "zero: refused, the sensor's range is not known; give wrench.range_n in sensor.yaml"};
  return kTexts[static_cast<std::size_t>(answer)];
}

}  // namespace tagwrench
