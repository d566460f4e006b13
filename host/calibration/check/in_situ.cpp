#include "host/calibration/check/in_situ.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/rotation.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr double kSigmas = 3;
constexpr double kSlip = 5e-6;       // m; what light and print do to a tag that has not moved
constexpr double kSlipAngle = 2e-3;  // rad
constexpr double kBlur_px2 = 0.15;   // either way
constexpr double kResidualFraction = 0.05;
constexpr double kDarkest = 50;          // white, counts
constexpr double kDimmed = 0.5;          // white over that at rest
constexpr double kClippedMore = 0.05;    // of the tags, than at rest
constexpr double kZeroOff = 0.02;        // of the range; also of a load cell's line
constexpr double kRestElsewhere = 0.10;  // of the range
constexpr double kScaleOff = 0.02;
constexpr double kOffLine = 0.05;  // of the range

bool scale_is_off(double scale, double sigma) {
  return std::abs(scale - 1) > std::max(kScaleOff, kSigmas * sigma);
}

/// Displacement of the platform's origin -> of a point of it, for small turns.
Matrix6 at_point(const Eigen::Vector3d& point) {
  Matrix6 m = Matrix6::Identity();
  m.topRightCorner<3, 3>() = cross_matrix(-point);
  return m;
}

/// Of a mean: its own frames' noise, and that of the picture it is compared with.
Matrix6 mean_covariance(const TagAtRest& tag, const AtRest& rest) {
  return tag.covariance * (1.0 / std::max(1, rest.frames) + 1.0 / std::max(1, rest.rest_frames));
}

double largest_share(const Vector6& value, const Vector6& limit) {
  return (value.array().abs() / limit.array()).maxCoeff();
}

const Vector6 kFloor{kSlip, kSlip, kSlip, kSlipAngle, kSlipAngle, kSlipAngle};

/// How far tag a lies from where tag b says it must, over what may be; above 1 they disagree.
struct Disagreement {
  double share = 0;
  Vector6 move = Vector6::Zero();  ///< of a's centre
};

Disagreement disagreement(const TagAtRest& a, const TagAtRest& b, const AtRest& rest) {
  const Matrix6 to_a = at_point(a.centre);
  const Matrix6 covariance =
      to_a * (mean_covariance(a, rest) + mean_covariance(b, rest)) * to_a.transpose();
  const Vector6 move = to_a * (a.displacement - b.displacement);
  const Vector6 limit = kSigmas * covariance.diagonal().cwiseMax(0).cwiseSqrt() + kFloor;
  return {largest_share(move, limit), move};
}

InSituFinding judge_light(const AtRest& rest) {
  InSituFinding finding{.subject = Subject::light,
                        .amount = rest.now.white_counts,
                        .expected = rest.then.white_counts};
  if (rest.now.white_counts < std::max(kDarkest, kDimmed * rest.then.white_counts)) {
    finding.fault = Fault::too_dark;
  } else if (rest.now.clipped_fraction > rest.then.clipped_fraction + kClippedMore) {
    finding.fault = Fault::too_bright;
    finding.amount = rest.now.clipped_fraction;
    finding.expected = rest.then.clipped_fraction;
  }
  return finding;
}

/// By the alignment, which feels a hundredth of a pixel; where it does not hold, by the edges.
InSituFinding judge_focus(const AtRest& rest) {
  constexpr double kCoarse = 1.5;  // between two figures that are good to a third
  InSituFinding finding{.subject = Subject::focus};
  double sum = 0;
  int held = 0;
  for (const TagAtRest& tag : rest.tags) {
    if (!tag.held) continue;
    sum += tag.blur_px2;
    ++held;
  }
  if (held > 0) {
    finding.amount = sum / held;
    if (std::abs(finding.amount) > kBlur_px2) finding.fault = Fault::out_of_focus;
  } else if (rest.now.blur_px && rest.then.blur_px) {
    finding.amount = *rest.now.blur_px;
    finding.expected = *rest.then.blur_px;
    if (finding.amount > kCoarse * finding.expected) finding.fault = Fault::out_of_focus;
  } else {
    finding.fault = Fault::not_known;
  }
  return finding;
}

/// Tags are glued to one rigid platform: all must have moved alike. Of two that have not, the one
/// that is farther from rest has slipped, if it clearly is; of more, the one that most others
/// contradict.
InSituFinding judge_tags(const AtRest& rest) {
  InSituFinding finding{.subject = Subject::tags};
  const std::vector<TagAtRest>& tags = rest.tags;
  for (const TagAtRest& tag : tags) {
    if (tag.held) continue;
    finding.fault = Fault::tag_not_seen;
    finding.tag = tag.id;
    return finding;
  }
  if (tags.size() < 2) {
    finding.fault = Fault::not_known;
    return finding;
  }
  std::vector<int> contradicted(tags.size(), 0);
  Disagreement worst;
  for (std::size_t a = 0; a < tags.size(); ++a) {
    for (std::size_t b = 0; b < tags.size(); ++b) {
      if (a == b) continue;
      const Disagreement d = disagreement(tags[a], tags[b], rest);
      if (d.share > 1) ++contradicted[a];
      if (d.share > worst.share) worst = d;
    }
  }
  finding.move = worst.move;
  if (worst.share <= 1) return finding;

  std::vector<double> from_rest(tags.size());
  for (std::size_t a = 0; a < tags.size(); ++a)
    from_rest[a] = largest_share(at_point(tags[a].centre) * tags[a].displacement, kFloor);
  const auto suspect = [&](std::size_t a, std::size_t b) {
    return contradicted[a] != contradicted[b] ? contradicted[a] < contradicted[b]
                                              : from_rest[a] < from_rest[b];
  };
  std::vector<std::size_t> order(tags.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return suspect(b, a); });
  const std::size_t first = order[0], second = order[1];
  const bool clear =
      contradicted[first] > contradicted[second] || from_rest[first] > 2 * from_rest[second];
  finding.fault = clear ? Fault::tag_moved : Fault::some_tag_moved;
  finding.tag = tags[first].id;
  finding.move = disagreement(tags[first], tags[order.back()], rest).move;
  return finding;
}

InSituFinding judge_residual(const AtRest& rest) {
  InSituFinding finding{.subject = Subject::residual, .expected = kResidualFraction};
  bool known = false;
  for (const TagAtRest& tag : rest.tags) {
    if (!tag.held) continue;
    known = true;
    if (tag.residual_fraction < finding.amount) continue;
    finding.amount = tag.residual_fraction;
    finding.tag = tag.id;
  }
  if (!known) finding.fault = Fault::not_known;
  if (finding.amount > kResidualFraction) finding.fault = Fault::residual_grown;
  return finding;
}

InSituFinding judge_zero(const AtRest& rest) {
  InSituFinding finding{.subject = Subject::zero};
  bool known = false;
  for (int i = 0; i < 6; ++i) {
    if (!(rest.range[i] > 0 && rest.range[i] < kUnknownRange)) continue;
    known = true;
    const double share = rest.wrench[i] / rest.range[i];
    if (std::abs(share) < std::abs(finding.amount)) continue;
    finding.amount = share;
    finding.axis = i;
  }
  if (!rest.held || !known)
    finding.fault = Fault::not_known;
  else if (std::abs(finding.amount) > kRestElsewhere)
    finding.fault = Fault::rest_elsewhere;
  else if (std::abs(finding.amount) > kZeroOff)
    finding.fault = Fault::zero_drifted;
  return finding;
}

// What a load cell that stays must show before its sensor is doubted.
constexpr double kMemory = 60;         // s
constexpr double kExcitation = 0.03;   // of the range; forces that vary less tell no scale
constexpr double kDwell = 5;           // s for which a fault must last before it is one
constexpr double kCellOffLine = 0.10;  // of the range: other loads than the cell's; not compared
constexpr double kCorrelation = 0.2;   // s, between frames of independent errors: a hand's motion
constexpr double kMaxGap = 1;          // s that one pair may stand for
constexpr double kMinPairs = 20;       // independent pairs before a line is drawn
constexpr double kHuber = 2.5;         // standard deviations
constexpr double kNever = 1e300;

constexpr Duration kLookBack = std::chrono::seconds(1);
constexpr Duration kMinLook = std::chrono::milliseconds(300);
constexpr double kTurned = 1.06;  // ratio of widths that says that somebody turns
constexpr double kAway = 1.10;    // from the best
constexpr double kWorse = 1.20;   // than the best: there is nothing to be found on that side
constexpr double kClear = 0.97;   // a new dip, and not the old one once more

}  // namespace

std::vector<InSituFinding> judge(const AtRest& rest) {
  std::vector<InSituFinding> findings = {judge_light(rest), judge_focus(rest), judge_tags(rest),
                                         judge_residual(rest), judge_zero(rest)};
  // A slipped tag moves the wrench too; that is not to be zeroed away.
  const Fault tags = findings[2].fault;
  if (tags == Fault::tag_moved || tags == Fault::some_tag_moved)
    findings[4].fault = Fault::not_known;
  return findings;
}

InSituFinding judge(const ProofLoad& load) {
  InSituFinding finding{.subject = Subject::scale};
  const Ldlt<6> covariance(load.known_covariance + load.measured_covariance);
  const Vector6 weighted = covariance.solve(load.known);
  const double information = load.known.dot(weighted);
  finding.amount = weighted.dot(load.measured) / information;
  finding.sigma = 1 / std::sqrt(information);
  if (!(information > 0) || !std::isfinite(finding.amount)) {
    finding.fault = Fault::not_known;
    return finding;
  }
  // What no scale explains: it hangs elsewhere, or pulls along another line.
  const Vector6 rest = load.measured - finding.amount * load.known;
  const Vector6 sigma =
      (load.known_covariance + load.measured_covariance).diagonal().cwiseMax(0).cwiseSqrt();
  double worst = kOffLine;
  for (int i = 0; i < 6; ++i) {
    if (!(load.range[i] > 0 && load.range[i] < kUnknownRange)) continue;
    const double share = std::abs(rest[i]) / load.range[i];
    if (share <= worst || std::abs(rest[i]) <= kSigmas * sigma[i]) continue;
    worst = share;
    finding.axis = i;
    finding.fault = Fault::load_elsewhere;
    finding.expected = share;
  }
  if (finding.fault == Fault::load_elsewhere) return finding;
  if (scale_is_off(finding.amount, finding.sigma)) finding.fault = Fault::scale_wrong;
  return finding;
}

InSituFinding judge(const ReferenceMonitor& monitor) {
  InSituFinding finding{
      .subject = Subject::scale, .amount = monitor.scale(), .sigma = monitor.scale_sigma()};
  if (!(finding.sigma < kScaleOff / kSigmas))
    finding.fault = Fault::not_known;
  else if (scale_is_off(finding.amount, finding.sigma))
    finding.fault = Fault::scale_wrong;
  return finding;
}

void ReferenceMonitor::fit() noexcept {
  slope_sigma_ = zero_sigma_ = kNever;
  if (independent_ < kMinPairs || !(scatter_(0, 0) > 0)) return;
  slope_ = scatter_(0, 1) / scatter_(0, 0);
  zero_ = mean_[1] - slope_ * mean_[0];
  const double variance = std::max(0.0, scatter_(1, 1) - slope_ * scatter_(0, 1)) / weight_;
  residual_ = std::sqrt(variance);
  const double spread = scatter_(0, 0) / weight_;
  const double of_mean = variance / (independent_ - 2);
  slope_sigma_ = std::sqrt(of_mean / spread);
  zero_sigma_ = std::sqrt(of_mean * (1 + mean_[0] * mean_[0] / spread));
}

bool ReferenceMonitor::confirmed(Suspicion& suspicion, bool now, double dt) const noexcept {
  suspicion.lasted = now ? suspicion.lasted + dt : 0;
  if (suspicion.told || suspicion.lasted < kDwell) return false;
  return suspicion.told = true;
}

ReferenceFault ReferenceMonitor::add(TimePoint time, const Vector6& wrench, const Vector6& line,
                                     const Vector6& range, double force) noexcept {
  Vector6 u = Vector6::Zero(), m = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    if (!(range[i] > 0 && range[i] < kUnknownRange)) continue;
    u[i] = line[i] / range[i];
    m[i] = wrench[i] / range[i];
  }
  const double along = u.squaredNorm();
  if (!(along > 0) || !std::isfinite(force) || !m.allFinite()) return ReferenceFault::none;
  range_ = 1 / u.cwiseAbs().maxCoeff();
  const double measured = u.dot(m) / along;
  const double since = started_ ? std::chrono::duration<double>(time - last_).count() : 0.0;
  const double dt = std::clamp(since, 0.0, kMaxGap);
  if (started_ && since <= 0) return ReferenceFault::none;
  started_ = true;
  last_ = time;
  if ((m - u * measured).cwiseAbs().maxCoeff() > kCellOffLine) return ReferenceFault::none;

  const double kept = std::exp(-dt / kMemory);
  weight_ *= kept;
  independent_ *= kept;
  scatter_ *= kept;
  double weight = 1;
  if (slope_sigma_ < kNever && residual_ > 0) {
    const double off = std::abs(measured - zero_ - slope_ * force) / residual_;
    weight = std::min(1.0, kHuber / std::max(off, 1e-9));
  }
  // West, "Updating mean and variance estimates", CACM 22(9), 1979.
  weight_ += weight;
  const double part = weight / weight_;
  const Eigen::Vector2d off_mean = Eigen::Vector2d(force, measured) - mean_;
  mean_ += part * off_mean;
  scatter_ += weight * (1 - part) * off_mean * off_mean.transpose();
  independent_ += weight * std::min(1.0, dt / kCorrelation);
  fit();

  const bool excited = std::sqrt(scatter_(0, 0) / weight_) > kExcitation * range_;
  const bool scale_off =
      excited && slope_sigma_ < kScaleOff / kSigmas && scale_is_off(slope_, slope_sigma_);
  const double zero_limit = kZeroOff * range_;
  const bool zero_off = zero_sigma_ < zero_limit / kSigmas && std::abs(zero_) > zero_limit &&
                        std::abs(zero_) > kSigmas * zero_sigma_;
  if (confirmed(scale_fault_, scale_off, dt)) return ReferenceFault::scale;
  if (confirmed(zero_fault_, zero_off, dt)) return ReferenceFault::zero;
  return ReferenceFault::none;
}

void FocusGuide::add(TimePoint time, double width_px, unsigned tags) {
  if (tags != tags_) *this = {};
  tags_ = tags;
  // One frame alone may be wrong.
  const double held_px = seen_.empty() ? width_px : std::max(width_px, seen_.back().width_px);
  now_px_ = width_px;
  best_px_ = best_px_ > 0 ? std::min(best_px_, held_px) : held_px;
  if (worst_since_px_ > 0 && best_px_ < kClear * dip_px_) {
    worst_before_px_ = std::max(worst_before_px_, worst_since_px_);
    worst_since_px_ = 0;
  }
  if (worst_since_px_ == 0) dip_px_ = best_px_;
  worst_since_px_ = std::max(worst_since_px_, width_px);
  seen_.push_back({time, width_px});
  std::erase_if(seen_, [&](const Seen& s) { return time - s.time > kLookBack; });
  const Seen& before = seen_.front();
  if (time - before.time < kMinLook) {
    turn_ = FocusTurn::begin;
  } else if (width_px * kTurned < before.width_px) {
    turn_ = FocusTurn::sharper;
  } else if (width_px > kTurned * before.width_px) {
    turn_ = FocusTurn::blurrier;
  } else if (width_px > kAway * best_px_) {
    turn_ = FocusTurn::away;
  } else {
    const bool between = std::min(worst_before_px_, worst_since_px_) > kWorse * best_px_;
    turn_ = between ? FocusTurn::best : FocusTurn::try_on;
  }
}

double FocusGuide::more_noise() const {
  constexpr double kPixelVariance = 1.0 / 12;
  const double now = now_px_ * now_px_ + kPixelVariance;
  const double best = best_px_ * best_px_ + kPixelVariance;
  return best_px_ > 0 ? std::max(0.0, std::pow(now / best, 0.25) - 1) : 0;
}

}  // namespace tagwrench
