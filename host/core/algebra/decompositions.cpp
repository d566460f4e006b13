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

}  // namespace tagwrench
