#include "host/calibration/analysis/regression.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/core/algebra/decompositions.h"

namespace tagwrench::study {
namespace {

/// Eigenvalues of the correlation matrix below this, of the largest, are rounding.
constexpr double kRankTolerance = 1e-12;
constexpr double kRounding = 1e-9;  // of the largest value: less is no change

Eigen::MatrixXd standardised(const LinearModel& model, const Eigen::MatrixXd& features) {
  return (features.rowwise() - model.mean.transpose()) * model.scale.asDiagonal();
}

}  // namespace

Eigen::MatrixXd LinearModel::predict(const Eigen::MatrixXd& features) const {
  return (standardised(*this, features) * weights).rowwise() + offset.transpose();
}

Eigen::MatrixXd LinearModel::sigma(const Eigen::MatrixXd& features) const {
  const Eigen::MatrixXd z = standardised(*this, features);
  const Eigen::ArrayXd leverage =
      1.0 / static_cast<double>(rows) + (z * inverse).cwiseProduct(z).rowwise().sum().array();
  return (1 + leverage).sqrt().matrix() * variance.cwiseSqrt().transpose();
}

Eigen::MatrixXd LinearModel::matrix() const { return weights.transpose() * scale.asDiagonal(); }

Eigen::VectorXd LinearModel::constant() const { return offset - matrix() * mean; }

LinearModel fit_linear(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values,
                       double ridge) {
  LinearModel model;
  model.rows = features.rows();
  const auto n = static_cast<double>(features.rows());
  model.mean = features.colwise().mean();
  const Eigen::MatrixXd centred = features.rowwise() - model.mean.transpose();
  model.scale = Eigen::VectorXd::Zero(features.cols());
  for (Eigen::Index i = 0; i < features.cols(); ++i) {
    const double deviation = std::sqrt(centred.col(i).squaredNorm() / n);
    const double rounding = 1e-13 * (features.col(i).cwiseAbs().maxCoeff() + 1e-300);
    if (deviation > rounding) model.scale[i] = 1 / deviation;
  }
  const Eigen::MatrixXd z = centred * model.scale.asDiagonal();
  model.offset = values.colwise().mean();
  const Eigen::MatrixXd y = values.rowwise() - model.offset.transpose();

  const EigenSystem<Eigen::Dynamic> eigen = symmetric_eigen(Eigen::MatrixXd(z.transpose() * z / n));
  const Eigen::VectorXd& lambda = eigen.values;
  const double largest = lambda.size() > 0 ? lambda[lambda.size() - 1] : 0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(lambda.size());
  double freedom = 1;
  double smallest = largest;
  for (Eigen::Index i = 0; i < lambda.size(); ++i) {
    if (lambda[i] <= kRankTolerance * largest) continue;
    inverse[i] = 1 / ((lambda[i] + ridge) * n);
    freedom += lambda[i] / (lambda[i] + ridge);
    smallest = std::min(smallest, lambda[i]);
  }
  const auto changing = (model.scale.array() > 0).count();
  const bool full = (inverse.array() > 0).count() == changing;
  model.condition = full && changing > 0 ? std::sqrt(largest / smallest)
                                         : std::numeric_limits<double>::infinity();
  model.inverse = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
  model.weights = model.inverse * (z.transpose() * y);
  model.variance = (y - z * model.weights).colwise().squaredNorm() / std::max(1.0, n - freedom);
  return model;
}

Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  const Eigen::RowVectorXd mean = truth.colwise().mean();
  const Eigen::RowVectorXd total = (truth.rowwise() - mean).colwise().squaredNorm();
  const Eigen::RowVectorXd left = (predicted - truth).colwise().squaredNorm();
  Eigen::VectorXd r2(truth.cols());
  for (Eigen::Index i = 0; i < r2.size(); ++i) {
    const double rounding = kRounding * truth.col(i).cwiseAbs().maxCoeff();
    const bool changes = total[i] > static_cast<double>(truth.rows()) * rounding * rounding;
    r2[i] = changes ? 1 - left[i] / total[i] : std::numeric_limits<double>::quiet_NaN();
  }
  return r2;
}

Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  return (predicted - truth).colwise().norm() / std::sqrt(static_cast<double>(truth.rows()));
}

}  // namespace tagwrench::study
