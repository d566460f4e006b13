// Linear regression of a reference on features, standardised, with an optional ridge.
#pragma once

#include <Eigen/Core>

namespace tagwrench::study {

struct LinearModel {
  Eigen::VectorXd mean;      ///< p, of the features
  Eigen::VectorXd scale;     ///< p, 1 / standard deviation; 0 for a feature that never changed
  Eigen::MatrixXd weights;   ///< p x q, of standardised features
  Eigen::VectorXd offset;    ///< q
  Eigen::MatrixXd inverse;   ///< p x p, of (Z^T Z + ridge n I)
  Eigen::VectorXd variance;  ///< q, of the residuals, by their degrees of freedom
  double condition = 0;      ///< of the standardised features, those that never changed apart
  Eigen::Index rows = 0;

  Eigen::MatrixXd predict(const Eigen::MatrixXd& features) const;
  /// Standard deviation of the error of each prediction, fit and residuals together: k x q.
  Eigen::MatrixXd sigma(const Eigen::MatrixXd& features) const;
  Eigen::MatrixXd matrix() const;  ///< q x p: y = matrix() * features + constant()
  Eigen::VectorXd constant() const;
};

/// Least squares with the penalty ridge * n * |weights|^2 on standardised features. Combinations of
/// features that never changed get no weight. Needs two rows at least.
LinearModel fit_linear(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values,
                       double ridge);

/// 1 - squares of the errors / squares about the mean, per column; NaN where nothing changed.
Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

/// Root mean square of the errors, per column.
Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

}  // namespace tagwrench::study
