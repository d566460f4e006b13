#include "host/calibration/target/equations.h"

#include <Eigen/Cholesky>

#include "host/core/algebra/decompositions.h"

namespace tagwrench {
namespace {

using Places = Eigen::Matrix<Eigen::Index, 6, 1>;

constexpr double kLengthUnit = 5e-3;  // m
constexpr double kSpreadUnit = 1e-4;  // m
constexpr double kPartUnit = 0.05;
constexpr double kReadoutUnit = 0.1;  // s

Eigen::VectorXd unit_vector(Eigen::Index frames, Eigen::Index tags) {
  const Eigen::Index prints = 6 * (frames + tags);
  Eigen::VectorXd units = Eigen::VectorXd::Ones(prints + kPrintModes * tags + 2);
  for (Eigen::Index i = 0; i < frames + tags; ++i) units.segment<3>(6 * i).setConstant(kLengthUnit);
  for (Eigen::Index t = 0; t < tags; ++t)
    units.segment<kPrintModes>(prints + kPrintModes * t) << kSpreadUnit, kSpreadUnit, kPartUnit,
        kPartUnit, kPartUnit;
  units[prints + kPrintModes * tags] = kReadoutUnit;
  return units;
}

}  // namespace

EdgeDerivatives edge_derivatives(const CameraModel& camera, const EdgeMeasurement& measurement,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const Eigen::Isometry3d& rest_camera_T_platform,
                                 const Eigen::Isometry3d& camera_T_tag,
                                 const Eigen::Vector3d& point) {
  EdgeDerivatives by;
  by.frame = measurement.row;
  by.normal = measurement.px_per_m;
  // A motion (t, r) of the tag at rest moves the point by t + r x arm at rest, and by that turned
  // in the picture.
  const Eigen::Matrix3d turn =
      camera_T_platform.linear() * rest_camera_T_platform.linear().transpose();
  const Eigen::Vector3d pull = turn.transpose() * measurement.row.head<3>();
  const Eigen::Vector3d arm = camera_T_tag.linear() * point;
  by.tag << pull, arm.cross(pull);
  // measurement.row begins with J^T n, n the direction of the profile and J the projection's
  // derivative; the image grows about the principal point.
  const Eigen::Vector3d p =
      camera_T_platform * (rest_camera_T_platform.inverse() * (camera_T_tag * point));
  const ProjectedPoint seen = project(camera, p);
  const Eigen::Matrix2d square = seen.jacobian * seen.jacobian.transpose();
  const Eigen::Vector2d direction = square.inverse() * (seen.jacobian * measurement.row.head<3>());
  by.focal = direction.dot(seen.pixel - Eigen::Vector2d(camera.cx_px, camera.cy_px));
  by.row_px = seen.pixel.y();
  return by;
}

TargetNormal::TargetNormal(int frames, int tags, Eigen::Index points)
    : tags_(tags),
      moving_(6 * frames),
      shared_((6 + kPrintModes) * tags + 2),
      units_(unit_vector(frames, tags)) {
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
  const bool moves = equation.frame >= 0;
  const Eigen::Index frame = moves ? 6 * equation.frame : 0;
  Eigen::Matrix<Eigen::Index, 14, 1> at;
  at << Places::LinSpaced(frame, frame + 5), Places::LinSpaced(tag, tag + 5), camera, camera + 1;
  Eigen::Matrix<double, 14, 1> by;
  by << (moves ? 1 : 0) * equation.by.frame, equation.by.tag, equation.by.readout,
      equation.by.focal;
  by.array() *= units_(at).array();
  normal_(at, at) += w * by * by.transpose();
  right_(at) += w * equation.offset * by;
  const double v = w * equation.by.normal;
  coupling_.col(equation.point)(at) += v * by;
  pivot_[equation.point] += v * equation.by.normal;
  pull_[equation.point] += v * equation.offset;
}

void TargetNormal::add_print(Eigen::Index point, int tag, const PrintModes& row, double offset,
                             double weight) {
  const Eigen::Index first = moving_ + print_index(tag);
  const PrintModes by = row.cwiseProduct(units_.segment<kPrintModes>(first));
  normal_.block<kPrintModes, kPrintModes>(first, first) += weight * by * by.transpose();
  right_.segment<kPrintModes>(first) -= weight * offset * by;
  coupling_.col(point).segment<kPrintModes>(first) -= weight * by;
  pivot_[point] += weight;
  pull_[point] += weight * offset;
}

void TargetNormal::add_prior(Eigen::Index shared, double offset, double weight) {
  const Eigen::Index at = moving_ + shared;
  normal_(at, at) += weight * units_[at] * units_[at];
  right_[at] += weight * offset * units_[at];
}

void TargetNormal::add_total_size(double offset, double weight) {
  for (int a = 0; a < tags_; ++a) {
    const Eigen::Index i = moving_ + print_index(a) + kSizeMode;
    right_[i] += weight * offset * units_[i];
    for (int b = 0; b < tags_; ++b) {
      const Eigen::Index j = moving_ + print_index(b) + kSizeMode;
      normal_(i, j) += weight * units_[i] * units_[j];
    }
  }
}

bool TargetNormal::reduce() {
  if (!(pivot_.array() > 0).all()) return false;
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

Eigen::VectorXd TargetNormal::reduced_pull(const Eigen::VectorXd& pull) const {
  const auto lower = normal_.topLeftCorner(moving_, moving_).triangularView<Eigen::Lower>();
  Eigen::VectorXd frames = pull.head(moving_).cwiseProduct(units_.head(moving_));
  lower.solveInPlace(frames);
  lower.transpose().solveInPlace(frames);
  const Eigen::VectorXd given = normal_.bottomLeftCorner(shared_, moving_) * frames;
  return pull.tail(shared_) - given.cwiseQuotient(units_.tail(shared_));
}

Eigen::VectorXd TargetNormal::point_pull(Eigen::Index point, double pull) const {
  return -(pull / pivot_[point]) * coupling_.col(point).cwiseQuotient(units_);
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
