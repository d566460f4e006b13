#include "host/calibration/analysis/smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/core/robust_statistics.h"

namespace tagwrench::study {

namespace {
constexpr int kPointsAside = 10;  // of the triangle
}

Eigen::MatrixXd smooth_rows(const Eigen::MatrixXd& rows) {
  Eigen::MatrixXd smooth = rows;
  const Eigen::Index n = rows.rows() - 2;
  if (n > 0) {
    smooth.middleRows(1, n) =
        0.25 * rows.topRows(n) + 0.5 * rows.middleRows(1, n) + 0.25 * rows.bottomRows(n);
  }
  return smooth;
}

Eigen::MatrixXd smooth_reference(const Eigen::VectorXd& time, const Eigen::MatrixXd& values,
                                 double period) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(values.rows(), values.cols());
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(values.rows());
  for (int j = -kPointsAside; j <= kPointsAside; ++j) {
    const double offset = period * j / (kPointsAside + 1);
    const double w = 1 - std::abs(offset) / period;
    const Eigen::MatrixXd at =
        reference_at(time, -offset, time, values, std::numeric_limits<double>::infinity());
    for (Eigen::Index i = 0; i < at.rows(); ++i) {
      if (!at.row(i).allFinite()) continue;
      sum.row(i) += w * at.row(i);
      weight[i] += w;
    }
  }
  return weight.cwiseInverse().asDiagonal() * sum;
}

double median_interval(const Eigen::VectorXd& time) {
  if (time.size() < 2) return 0;
  std::vector<double> intervals(static_cast<std::size_t>(time.size() - 1));
  for (Eigen::Index i = 1; i < time.size(); ++i)
    intervals[static_cast<std::size_t>(i - 1)] = time[i] - time[i - 1];
  return median(std::move(intervals));
}

}  // namespace tagwrench::study
