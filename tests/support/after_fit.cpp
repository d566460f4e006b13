#include "tests/support/after_fit.h"

#include <Eigen/Dense>
#include <limits>

namespace tagwrench::test {

Vector6 error_after_fit(const std::vector<Vector6>& readings, const std::vector<Vector6>& truths) {
  constexpr std::size_t kMin = 60;
  if (readings.size() < kMin || readings.size() != truths.size())
    return Vector6::Constant(std::numeric_limits<double>::quiet_NaN());
  // In millimetres and ten milliradians the columns are alike.
  Vector6 scale;
  scale << 1e3, 1e3, 1e3, 1e2, 1e2, 1e2;
  const auto count = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd from(count, 7);
  Eigen::MatrixXd to(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    from.row(i) << scale.cwiseProduct(readings[at]).transpose(), 1;
    to.row(i) = truths[at].transpose();
  }
  const Eigen::Index half = count / 2;
  const Eigen::MatrixXd map = from.topRows(half).colPivHouseholderQr().solve(to.topRows(half));
  const Eigen::MatrixXd error = from.bottomRows(count - half) * map - to.bottomRows(count - half);
  return error.colwise().squaredNorm().transpose().cwiseSqrt() /
         std::sqrt(static_cast<double>(count - half));
}

}  // namespace tagwrench::test
