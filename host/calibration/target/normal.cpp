#include "host/calibration/target/normal.h"

#include <Eigen/Cholesky>

#include "host/core/algebra/decompositions.h"

namespace tagwrench {
namespace {

constexpr double kLengthUnit = 5e-3;  // m
constexpr double kSpreadUnit = 1e-4;  // m
constexpr double kReadoutUnit = 0.1;  // s

Eigen::VectorXd unit_vector(Eigen::Index frames, Eigen::Index tags) {
  Eigen::VectorXd units = Eigen::VectorXd::Ones(6 * (frames + tags) + tags + 2);
  for (Eigen::Index i = 0; i < frames + tags; ++i) units.segment<3>(6 * i).setConstant(kLengthUnit);
  units.segment(6 * (frames + tags), tags).setConstant(kSpreadUnit);
  units[6 * (frames + tags) + tags] = kReadoutUnit;
  return units;
}

}  // namespace

TargetNormal::TargetNormal(int frames, int tags, Eigen::Index points)
    : tags_(tags), moving_(6 * frames), shared_(7 * tags + 2), units_(unit_vector(frames, tags)) {
  const Eigen::Index all = moving_ + shared_;
  normal_ = Eigen::MatrixXd::Zero(all, all);
  right_ = Eigen::VectorXd::Zero(all);
  coupling_ = Eigen::MatrixXd::Zero(all, points);
  pivot_ = Eigen::VectorXd::Zero(points);
  pull_ = Eigen::VectorXd::Zero(points);
}

void TargetNormal::add(const EdgeEquation& equation) {
  const double w = equation.weight;
  const Eigen::Index tag = moving_ + 6 * equation.tag;
  const Eigen::Index camera = moving_ + readout_index();
  const Vector6 by_tag = equation.by_tag.cwiseProduct(units_.segment<6>(tag));
  const Eigen::Vector2d by_camera(equation.by_readout * units_[camera],
                                  equation.by_focal * units_[camera + 1]);

  normal_.block<6, 6>(tag, tag) += w * by_tag * by_tag.transpose();
  normal_.block<2, 6>(camera, tag) += w * by_camera * by_tag.transpose();
  normal_.block<2, 2>(camera, camera) += w * by_camera * by_camera.transpose();
  right_.segment<6>(tag) += w * equation.offset * by_tag;
  right_.segment<2>(camera) += w * equation.offset * by_camera;

  auto column = coupling_.col(equation.point);
  const double v = w * equation.by_normal;
  column.segment<6>(tag) += v * by_tag;
  column.segment<2>(camera) += v * by_camera;
  pivot_[equation.point] += v * equation.by_normal;
  pull_[equation.point] += v * equation.offset;
  if (equation.frame < 0) return;

  const Eigen::Index frame = 6 * equation.frame;
  const Vector6 by_frame = equation.by_frame.cwiseProduct(units_.segment<6>(frame));
  normal_.block<6, 6>(frame, frame) += w * by_frame * by_frame.transpose();
  normal_.block<6, 6>(tag, frame) += w * by_tag * by_frame.transpose();
  normal_.block<2, 6>(camera, frame) += w * by_camera * by_frame.transpose();
  right_.segment<6>(frame) += w * equation.offset * by_frame;
  column.segment<6>(frame) += v * by_frame;
}

void TargetNormal::add_print(Eigen::Index point, int tag, double offset, double weight) {
  const Eigen::Index spread = moving_ + spread_index(tag);
  const double unit = units_[spread];
  normal_(spread, spread) += weight * unit * unit;
  right_[spread] -= weight * offset * unit;
  coupling_(spread, point) -= weight * unit;
  pivot_[point] += weight;
  pull_[point] += weight * offset;
}

void TargetNormal::add_spread(int tag, double offset, double weight) {
  const Eigen::Index at = moving_ + spread_index(tag);
  const double unit = units_[at];
  normal_(at, at) += weight * unit * unit;
  right_[at] += weight * offset * unit;
}

void TargetNormal::add_readout(double offset, double weight) {
  const Eigen::Index at = moving_ + readout_index();
  const double unit = units_[at];
  normal_(at, at) += weight * unit * unit;
  right_[at] += weight * offset * unit;
}

bool TargetNormal::reduce() {
  for (Eigen::Index p = 0; p < pivot_.size(); ++p) {
    if (!(pivot_[p] > 0)) return false;
  }
  const Eigen::VectorXd root = pivot_.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = coupling_ * root.asDiagonal();
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(scaled, -1.0);
  right_ -= scaled * pull_.cwiseProduct(root);

  const Eigen::MatrixXd cross = normal_.bottomLeftCorner(shared_, moving_);
  reduced_ = normal_.bottomRightCorner(shared_, shared_).selfadjointView<Eigen::Lower>();
  reduced_right_ = right_.tail(shared_);
  if (moving_ == 0) return true;
  auto block = normal_.topLeftCorner(moving_, moving_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(block);  // in place
  if (factor.info() != Eigen::Success) return false;
  const auto lower = block.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd half = lower.solve(cross.transpose());
  reduced_ -= half.transpose() * half;
  reduced_right_ -= half.transpose() * lower.solve(right_.head(moving_));
  return reduced_.allFinite();
}

Eigen::MatrixXd TargetNormal::information() const {
  const auto units = units_.tail(shared_).cwiseInverse();
  return units.asDiagonal() * reduced_ * units.asDiagonal();
}

Eigen::VectorXd TargetNormal::shared_step(bool free_focal) const {
  const Eigen::Index count = free_focal ? shared_ : shared_ - 1;
  const Ldlt<Eigen::Dynamic> factor(reduced_.topLeftCorner(count, count));
  if (!factor.positive(1e-14)) return {};
  Eigen::VectorXd step = Eigen::VectorXd::Zero(shared_);
  step.head(count) = factor.solve(reduced_right_.head(count));
  step.array() *= units_.tail(shared_).array();
  return step.allFinite() ? step : Eigen::VectorXd();
}

Eigen::VectorXd TargetNormal::frame_steps(const Eigen::VectorXd& shared) const {
  if (moving_ == 0) return {};
  const Eigen::VectorXd scaled = shared.cwiseQuotient(units_.tail(shared_));
  const auto lower = normal_.topLeftCorner(moving_, moving_).triangularView<Eigen::Lower>();
  Eigen::VectorXd steps =
      right_.head(moving_) - normal_.bottomLeftCorner(shared_, moving_).transpose() * scaled;
  lower.solveInPlace(steps);
  lower.transpose().solveInPlace(steps);
  return steps.cwiseProduct(units_.head(moving_));
}

Eigen::VectorXd TargetNormal::point_steps(const Eigen::VectorXd& shared,
                                          const Eigen::VectorXd& frames) const {
  Eigen::VectorXd all(moving_ + shared_);
  all << frames, shared;
  all.array() /= units_.array();
  return (pull_ - coupling_.transpose() * all).cwiseQuotient(pivot_);
}

}  // namespace tagwrench
