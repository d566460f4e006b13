#include "host/calibration/wrench/coverage.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "host/core/algebra/decompositions.h"

namespace tagwrench {
namespace {

constexpr double kMinSigma = 0.003;  // of range: more than a good weight promises
constexpr std::array<const char*, 6> kActs{"pushes along x", "pushes along y", "pushes along z",
                                           "tilts about x",  "tilts about y",  "twists about z"};

/// The axes that make up a direction, largest part first where it is one alone.
std::vector<int> parts(const Vector6& direction) {
  std::vector<int> axes;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(direction[i]) > 0.4 * direction.cwiseAbs().maxCoeff()) axes.push_back(i);
  }
  return axes;
}

std::string complaint(const Vector6& direction) {
  const std::vector<int> axes = parts(direction);
  const auto axis = [&](std::size_t i) { return static_cast<std::size_t>(axes[i]); };
  if (axes.size() == 1) return fmt::format("no load {}: {}", kActs[axis(0)], kWrenchAxes[axis(0)]);
  std::string names = kWrenchAxes[axis(0)];
  for (std::size_t i = 1; i < axes.size(); ++i)
    names += fmt::format("{}{}", i + 1 == axes.size() ? " and " : ", ", kWrenchAxes[axis(i)]);
  return fmt::format(
      "no loads tell {} from each other; they come in one proportion only: add a step at another "
      "point or along another line",
      names);
}

}  // namespace

WrenchCoverage::WrenchCoverage(const Vector6& range)
    : range_(range), information_(Matrix6::Identity() / (kPrior * kPrior)) {}

Vector6 WrenchCoverage::scaled(const KnownLoad& load) const {
  return load.wrench.cwiseQuotient(range_);
}

double WrenchCoverage::relative_variance(const KnownLoad& load) const {
  const Vector6 variances = load.covariance.diagonal().cwiseQuotient(range_.cwiseAbs2());
  return variances.mean() + kMinSigma * kMinSigma;
}

void WrenchCoverage::add(const KnownLoad& load) {
  const Vector6 w = scaled(load);
  information_ += w * w.transpose() / relative_variance(load);
}

void WrenchCoverage::add_movement(const Matrix6& second_moment) {
  const Vector6 inverse = range_.cwiseInverse();
  information_ += inverse.asDiagonal() * second_moment * inverse.asDiagonal() /
                  (kMovementSigma * kMovementSigma);
}

Matrix6 WrenchCoverage::posterior() const { return inverse(information_); }

Vector6 WrenchCoverage::sigma() const { return posterior().diagonal().cwiseSqrt(); }

Vector6 WrenchCoverage::covered() const { return (1 - sigma().array() / kPrior).max(0).matrix(); }

std::vector<std::string> WrenchCoverage::missing() const {
  const EigenSystem<6> eigen = symmetric_eigen(information_);
  const auto open = static_cast<int>(
      (eigen.values.array() < 1 / (kCovered * kCovered)).count());  // they come first
  // Directions of equal information mix at will; the axes that lie among them wholly are named
  // alone.
  Eigen::Matrix<double, 6, Eigen::Dynamic> span = eigen.vectors.leftCols(open);
  std::vector<std::string> out;
  for (int axis = 0; axis < 6; ++axis) {
    if (span.row(axis).norm() < 0.9) continue;
    out.push_back(complaint(Vector6::Unit(axis)));
    span.row(axis).setZero();
  }
  const int rest = open - static_cast<int>(out.size());
  if (rest <= 0) return out;
  const Eigen::MatrixXd directions = left_singular_vectors(span);
  for (int i = 0; i < rest; ++i) out.push_back(complaint(directions.col(i)));
  return out;
}

double WrenchCoverage::gain(const KnownLoad& load) const {
  const Matrix6 P = posterior();
  const Vector6 w = scaled(load);
  const Vector6 Pw = P * w;
  return Pw.squaredNorm() / (relative_variance(load) + w.dot(Pw)) / P.trace();
}

WrenchCoverage coverage_of(const WrenchPlan& plan, const Vector6& range) {
  WrenchCoverage coverage(range);
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    if (plan.steps[i].kind == StepKind::six_axis)
      coverage.add_movement((0.25 * range.cwiseAbs2()).asDiagonal());
    else
      coverage.add(expected_load(plan, static_cast<int>(i)));
  }
  return coverage;
}

}  // namespace tagwrench
