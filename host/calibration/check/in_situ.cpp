#include "host/calibration/check/in_situ.h"

#include <algorithm>
#include <cmath>

#include "host/core/algebra/decompositions.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Displacement of the platform's origin -> of a point of it, for small turns.
Matrix6 at_point(const Eigen::Vector3d& point) {
  Matrix6 m = Matrix6::Identity();
  m.topRightCorner<3, 3>() = -cross(point);
  return m;
}

/// Of a mean: its own frames' noise, and that of the picture it is compared with.
Matrix6 mean_covariance(const TagAtRest& tag, const AtRest& rest) {
  return tag.covariance * (1.0 / std::max(1, rest.frames) + 1.0 / std::max(1, rest.rest_frames));
}

double largest_share(const Vector6& value, const Vector6& limit) {
  return (value.array().abs() / limit.array()).maxCoeff();
}

Vector6 floor_of(const InSituLimits& limits) {
  Vector6 floor;
  floor << Eigen::Vector3d::Constant(limits.slip), Eigen::Vector3d::Constant(limits.slip_angle);
  return floor;
}

/// How far tag a lies from where tag b says it must, over what may be; above 1 they disagree.
struct Disagreement {
  double share = 0;
  Vector6 move = Vector6::Zero();  ///< of a's centre
};

Disagreement disagreement(const TagAtRest& a, const TagAtRest& b, const AtRest& rest,
                          const InSituLimits& limits) {
  const Matrix6 to_a = at_point(a.centre);
  const Matrix6 covariance =
      to_a * (mean_covariance(a, rest) + mean_covariance(b, rest)) * to_a.transpose();
  Disagreement result;
  result.move = to_a * (a.displacement - b.displacement);
  const Vector6 limit =
      limits.sigmas * covariance.diagonal().cwiseMax(0).cwiseSqrt() + floor_of(limits);
  result.share = largest_share(result.move, limit);
  return result;
}

InSituFinding judge_light(const AtRest& rest, const InSituLimits& limits) {
  InSituFinding finding{.subject = Subject::light,
                        .amount = rest.now.white_counts,
                        .expected = rest.then.white_counts};
  if (rest.now.white_counts < std::max(limits.darkest, limits.dimmed * rest.then.white_counts)) {
    finding.fault = Fault::too_dark;
  } else if (rest.now.clipped_fraction > rest.then.clipped_fraction + limits.clipped) {
    finding.fault = Fault::too_bright;
    finding.amount = rest.now.clipped_fraction;
    finding.expected = rest.then.clipped_fraction;
  }
  return finding;
}

/// By the alignment, which feels a hundredth of a pixel; where it does not hold, by the edges.
InSituFinding judge_focus(const AtRest& rest, const InSituLimits& limits) {
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
    if (std::abs(finding.amount) > limits.blur_px2) finding.fault = Fault::out_of_focus;
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
InSituFinding judge_tags(const AtRest& rest, const InSituLimits& limits) {
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
      const Disagreement d = disagreement(tags[a], tags[b], rest, limits);
      if (d.share > 1) ++contradicted[a];
      if (d.share > worst.share) worst = d;
    }
  }
  finding.move = worst.move;
  if (worst.share <= 1) return finding;

  std::vector<double> from_rest(tags.size());
  for (std::size_t a = 0; a < tags.size(); ++a)
    from_rest[a] = largest_share(at_point(tags[a].centre) * tags[a].displacement, floor_of(limits));
  const auto suspect = [&](std::size_t a, std::size_t b) {
    return contradicted[a] != contradicted[b] ? contradicted[a] < contradicted[b]
                                              : from_rest[a] < from_rest[b];
  };
  std::vector<std::size_t> order(tags.size());
  for (std::size_t a = 0; a < tags.size(); ++a) order[a] = a;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return suspect(b, a); });
  const std::size_t first = order[0], second = order[1];
  const bool clear =
      contradicted[first] > contradicted[second] || from_rest[first] > 2 * from_rest[second];
  finding.fault = clear ? Fault::tag_moved : Fault::some_tag_moved;
  finding.tag = tags[first].id;
  finding.move = disagreement(tags[first], tags[order.back()], rest, limits).move;
  return finding;
}

InSituFinding judge_residual(const AtRest& rest, const InSituLimits& limits) {
  InSituFinding finding{.subject = Subject::residual, .expected = limits.residual_fraction};
  bool known = false;
  for (const TagAtRest& tag : rest.tags) {
    if (!tag.held) continue;
    known = true;
    if (tag.residual_fraction < finding.amount) continue;
    finding.amount = tag.residual_fraction;
    finding.tag = tag.id;
  }
  if (!known) finding.fault = Fault::not_known;
  if (finding.amount > limits.residual_fraction) finding.fault = Fault::residual_grown;
  return finding;
}

InSituFinding judge_zero(const AtRest& rest, const InSituLimits& limits) {
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
  if (!rest.held || !known) {
    finding.fault = Fault::not_known;
  } else if (std::abs(finding.amount) > limits.elsewhere) {
    finding.fault = Fault::rest_elsewhere;
  } else if (std::abs(finding.amount) > limits.zero) {
    finding.fault = Fault::zero_drifted;
  }
  return finding;
}

}  // namespace

std::vector<InSituFinding> judge(const AtRest& rest, const InSituLimits& limits) {
  std::vector<InSituFinding> findings = {judge_light(rest, limits), judge_focus(rest, limits),
                                         judge_tags(rest, limits), judge_residual(rest, limits),
                                         judge_zero(rest, limits)};
  // A slipped tag moves the wrench too; that is not to be zeroed away.
  const Fault tags = findings[2].fault;
  if (tags == Fault::tag_moved || tags == Fault::some_tag_moved)
    findings[4].fault = Fault::not_known;
  return findings;
}

InSituFinding judge(const ProofLoad& load, const InSituLimits& limits) {
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
  double worst = limits.off_line;
  for (int i = 0; i < 6; ++i) {
    if (!(load.range[i] > 0 && load.range[i] < kUnknownRange)) continue;
    const double share = std::abs(rest[i]) / load.range[i];
    if (share <= worst || std::abs(rest[i]) <= limits.sigmas * sigma[i]) continue;
    worst = share;
    finding.axis = i;
    finding.fault = Fault::load_elsewhere;
    finding.expected = share;
  }
  if (finding.fault == Fault::load_elsewhere) return finding;
  const double off = std::abs(finding.amount - 1);
  if (off > limits.scale && off > limits.sigmas * finding.sigma) {
    finding.fault = Fault::scale_wrong;
  }
  return finding;
}

InSituFinding judge(const ReferenceMonitor& monitor, const InSituLimits& limits) {
  InSituFinding finding{
      .subject = Subject::scale, .amount = monitor.scale(), .sigma = monitor.scale_sigma()};
  const double off = std::abs(finding.amount - 1);
  if (!(finding.sigma < limits.scale / limits.sigmas)) {
    finding.fault = Fault::not_known;
  } else if (off > limits.scale && off > limits.sigmas * finding.sigma) {
    finding.fault = Fault::scale_wrong;
  }
  return finding;
}

}  // namespace tagwrench
