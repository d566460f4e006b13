#include "host/core/algebra/decompositions.h"

namespace tagwrench {

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
