#include "host/core/algebra/decompositions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace tagwrench {

Matrix6 inverse(const Matrix6& m) noexcept { return m.inverse(); }

EigenSystem<6> symmetric_eigen(const Matrix6& m) noexcept {
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(m);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

EigenSystem<Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(m);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(a, b,
                                                                         Eigen::EigenvaluesOnly);
  return solver.info() == Eigen::Success ? solver.eigenvalues() : Eigen::VectorXd();
}

Eigen::MatrixXd left_singular_vectors(const Eigen::MatrixXd& m) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(m, Eigen::ComputeThinU).matrixU();
}

LeastSquares least_squares(const Eigen::MatrixXd& design, const Eigen::MatrixXd& values) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(design);
  return {qr.solve(values), qr.rank()};
}

template <int N>
Ldlt<N>::Ldlt(const Matrix& m) : factor_(m) {}

template <int N>
bool Ldlt<N>::positive(double least_rcond) const {
  return factor_.info() == Eigen::Success && factor_.isPositive() && factor_.rcond() > least_rcond;
}

template <int N>
typename Ldlt<N>::Vector Ldlt<N>::solve(const Vector& right) const {
  return factor_.solve(right);
}

template <int N>
typename Ldlt<N>::Matrix Ldlt<N>::inverse() const {
  return factor_.solve(Matrix::Identity(factor_.rows(), factor_.cols()));
}

template class Ldlt<5>;
template class Ldlt<6>;
template class Ldlt<8>;
template class Ldlt<Eigen::Dynamic>;

}  // namespace tagwrench
