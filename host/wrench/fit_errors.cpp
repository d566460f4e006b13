#include "host/wrench/fit_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "host/core/robust_statistics.h"

namespace tagwrench::fit {
namespace {

constexpr double kMedianChi2 = 5.348 / 6;   // of chi^2 with 6 degrees of freedom, over them
constexpr double kOutlierChi2 = 27.86 / 6;  // exceeded once in 10,000
constexpr double kWorthRejecting = 0.015;   // of full load: less is what model errors are for
constexpr double kMaxRejected = 0.25;       // of the blocks
constexpr double kStudent = 4;              // degrees of freedom of the robust weights
constexpr int kRobustRounds = 5;
constexpr int kRounds = 4;

/// RMS over a block, of the axis that is off most, of full load.
double largest_error(const Problem& problem, const std::vector<Prediction>& block) {
  Vector6 squares = Vector6::Zero();
  for (const Prediction& p : block) squares += p.error.cwiseQuotient(problem.scale).cwiseAbs2();
  return std::sqrt(squares.maxCoeff() / static_cast<double>(block.size()));
}

/// One number for all axes, that outliers do not move: the error model of that size makes the
/// median block as likely as it should be.
ErrorModel robust_error(const Problem& problem,
                        const std::vector<std::vector<Prediction>>& held_out) {
  const auto of_size = [&](double size) {
    return ErrorModel{size * kConstantFraction * problem.scale, size * problem.scale};
  };
  const auto too_small = [&](double size) {
    return median(block_chi2(problem, held_out, of_size(size))) > kMedianChi2;
  };
  if (!too_small(0)) return {};
  double low = -14, high = 1;  // natural logarithm of the part of full load
  for (int i = 0; i < 24; ++i) {
    const double middle = (low + high) / 2;
    (too_small(std::exp(middle)) ? low : high) = middle;
  }
  return of_size(std::exp(high));
}

/// One axis of a block: squared residual, its explained variance and squared load, mean over the
/// block.
struct AxisResidual {
  double squared = 0, explained = 0, load = 0;
};

double minus_log_likelihood(const std::vector<AxisResidual>& residuals, double constant,
                            double proportional) {
  double sum = 0;
  for (const AxisResidual& r : residuals) {
    const double variance = r.explained + constant + proportional * r.load;
    sum += std::log(variance) + r.squared / variance;
  }
  return sum;
}

/// Most likely variances beside the explained ones: a search on a grid that narrows, as the
/// likelihood is often largest at a zero.
std::pair<double, double> likely_variances(const std::vector<AxisResidual>& residuals) {
  double largest = 0;
  for (const AxisResidual& r : residuals) largest = std::max(largest, r.squared);
  double best = minus_log_likelihood(residuals, 0, 0);
  std::pair<double, double> out{0, 0};
  if (largest == 0) return out;
  constexpr double kFrom = -28;  // natural logarithm, of the largest: a millionth of its root
  std::pair<double, double> at{kFrom / 2, kFrom / 2};
  double step = 2;
  for (int round = 0; round < 4; ++round, step /= 3) {
    const int reach = round == 0 ? 8 : 3;
    const auto centre = at;
    for (int i = -reach; i <= reach; ++i) {
      for (int j = -reach; j <= reach; ++j) {
        const std::pair<double, double> log{centre.first + i * step, centre.second + j * step};
        const double a = log.first <= kFrom ? 0 : largest * std::exp(log.first);
        const double c = log.second <= kFrom ? 0 : largest * std::exp(log.second);
        const double value = minus_log_likelihood(residuals, a, c);
        if (value < best) {
          best = value;
          out = {a, c};
          at = log;
        }
      }
    }
  }
  return out;
}

/// Restricted maximum likelihood in effect, as held-out residuals carry the fit's uncertainty in
/// what explains them.
ErrorModel likely_error(const Problem& problem,
                        const std::vector<std::vector<Prediction>>& held_out,
                        const std::vector<double>& weight) {
  ErrorModel error;
  for (int axis = 0; axis < 6; ++axis) {
    std::vector<AxisResidual> residuals;
    for (std::size_t b = 0; b < held_out.size(); ++b) {
      if (weight[b] == 0) continue;
      AxisResidual mean;
      for (const Prediction& p : held_out[b]) {
        mean.squared += p.error[axis] * p.error[axis];
        mean.explained += p.covariance(axis, axis);
        mean.load += problem.rows[p.row].load;
      }
      const auto n = static_cast<double>(held_out[b].size());
      residuals.push_back({mean.squared / n, mean.explained / n, mean.load / n});
    }
    if (residuals.empty()) continue;
    const auto [constant, proportional] = likely_variances(residuals);
    // The estimate itself rests on few blocks; Student's distribution is that much wider.
    const auto n = static_cast<double>(residuals.size());
    const double few = n > 4 ? n / (n - 2) : 2;
    error.constant[axis] = std::sqrt(few * constant);
    error.proportional[axis] = std::sqrt(few * proportional);
  }
  return error;
}

/// Residuals of frames one after the other are alike, so that a push of 500 frames does not tell
/// what 500 independent ones would: the scores of its parts scatter more than their information
/// says (Liang and Zeger, Biometrika 73, 13, 1986; here one factor for all). Corrected for what
/// the fit has taken out of the residuals.
double dispersion(const Problem& problem, const Solution& solution, const Weighting& weighting) {
  double found = 0, expected = 0;
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    if (!problem.blocks[b].is_long || weighting.block[b] == 0) continue;
    const Normal& block = solution.blocks[b];
    const Eigen::VectorXd score = block.right - block.information * solution.unknowns;
    const Eigen::MatrixXd share = block.information * solution.covariance;
    found += score.dot(solution.covariance * score);
    expected += share.trace() - share.cwiseProduct(share.transpose()).sum();
  }
  if (!(expected > 0)) return 1;
  return std::max(1.0, weighting.dispersion * found / expected);
}

/// False if so many blocks disagree that it is not they that are wrong.
bool reject(const Problem& problem, const std::vector<std::vector<Prediction>>& held_out,
            const std::vector<double>& chi2, const std::vector<bool>& left_out,
            std::vector<double>& weight) {
  std::size_t rejected = 0;
  for (std::size_t b = 0; b < chi2.size(); ++b) {
    const bool off = left_out[b] || is_outlier(problem, held_out[b], chi2[b]);
    weight[b] = off ? 0.0 : 1.0;
    if (off) ++rejected;
  }
  const auto most =
      static_cast<std::size_t>(kMaxRejected * static_cast<double>(problem.blocks.size()));
  if (rejected <= most) return true;
  for (std::size_t b = 0; b < weight.size(); ++b) weight[b] = left_out[b] ? 0.0 : 1.0;
  return false;
}

}  // namespace

std::vector<double> block_chi2(const Problem& problem,
                               const std::vector<std::vector<Prediction>>& held_out,
                               const ErrorModel& error) {
  std::vector<double> out;
  for (const std::vector<Prediction>& block : held_out) {
    double sum = 0;
    for (const Prediction& p : block) {
      Matrix6 S = p.covariance;
      S.diagonal() += error.variance(problem.rows[p.row].load);
      sum += p.error.dot(S.llt().solve(p.error)) / 6;
    }
    out.push_back(sum / static_cast<double>(block.size()));
  }
  return out;
}

bool is_outlier(const Problem& problem, const std::vector<Prediction>& held_out, double chi2) {
  return chi2 > kOutlierChi2 && largest_error(problem, held_out) > kWorthRejecting;
}

Judged judge(const Problem& problem, const std::vector<bool>& left_out) {
  Judged out;
  std::vector<double>& weight = out.weighting.block;
  for (const bool out_of_it : left_out) weight.push_back(out_of_it ? 0.0 : 1.0);
  Eigen::VectorXd start;
  const auto solve_again = [&] {
    out.solution = solve(problem, out.weighting, start);
    start = out.solution.unknowns;
    out.held_out = hold_out(problem, out.solution);
  };
  for (int round = 0; round < kRobustRounds; ++round) {
    solve_again();
    out.weighting.error = robust_error(problem, out.held_out);
    out.chi2 = block_chi2(problem, out.held_out, out.weighting.error);
    // Student's weights for six dimensions (Lange, Little and Taylor, J. Am. Stat. Assoc. 84, 881,
    // 1989).
    for (std::size_t b = 0; b < weight.size(); ++b)
      weight[b] = left_out[b] ? 0.0 : (kStudent + 6) / (kStudent + 6 * out.chi2[b]);
  }
  for (int round = 0; round < kRounds; ++round) {
    out.too_many_outliers = !reject(problem, out.held_out, out.chi2, left_out, weight);
    solve_again();
    out.weighting.error = likely_error(problem, out.held_out, weight);
    out.weighting.dispersion = dispersion(problem, out.solution, out.weighting);
    out.chi2 = block_chi2(problem, out.held_out, out.weighting.error);
  }
  solve_again();
  return out;
}

}  // namespace tagwrench::fit
