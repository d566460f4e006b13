#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "host/core/types.h"

namespace tagwrench {

// Eigen's decompositions, each compiled once: in every file that uses one they cost its compiler
// seconds. Those of fixed size take no memory from the heap.

/// By LU with partial pivots; not finite where `m` is singular.
Matrix6 inverse(const Matrix6& m) noexcept;

/// Of a symmetric matrix, whose lower triangle is read: eigenvalues, ascending, and unit
/// eigenvectors, column by column in the same order.
template <int N>
struct EigenSystem {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};
EigenSystem<6> symmetric_eigen(const Matrix6& m) noexcept;
EigenSystem<Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& m);

/// Ascending lambda of a x = lambda b x; a symmetric, b positive definite. Empty if they cannot be
/// had.
Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Left singular vectors, those of the largest singular values first; as many as the smaller side.
Eigen::MatrixXd left_singular_vectors(const Eigen::MatrixXd& m);

/// Least squares by QR with column pivots.
struct LeastSquares {
  Eigen::MatrixXd x;  ///< design columns x values columns
  Eigen::Index rank = 0;
};
LeastSquares least_squares(const Eigen::MatrixXd& design, const Eigen::MatrixXd& values);

/// L D L^T of a symmetric matrix, whose lower triangle is read. Sizes: those that are used.
template <int N>
class Ldlt {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  explicit Ldlt(const Matrix& m);
  /// It is positive and not nearer to singular than this reciprocal of its condition number (L1).
  bool positive(double least_rcond) const;
  Vector solve(const Vector& right) const;
  Matrix inverse() const;

 private:
  Eigen::LDLT<Matrix> factor_;
};

extern template class Ldlt<5>;
extern template class Ldlt<6>;
extern template class Ldlt<8>;
extern template class Ldlt<Eigen::Dynamic>;

}  // namespace tagwrench
