#pragma once

#include <Eigen/Core>

namespace tagwrench::test {

/// Derivatives of `function`, which makes a vector of a step in so many unknowns, by central
/// differences about no step; a column for each unknown.
template <int Unknowns, class Function>
Eigen::MatrixXd differences(const Function& function, double step) {
  using Step = Eigen::Matrix<double, Unknowns, 1>;
  Eigen::MatrixXd out;
  for (int k = 0; k < Unknowns; ++k) {
    const Step by = step * Step::Unit(k);
    const Eigen::VectorXd slope = (function(by) - function(-by)) / (2 * step);
    out.conservativeResize(slope.size(), k + 1);
    out.col(k) = slope;
  }
  return out;
}

}  // namespace tagwrench::test
