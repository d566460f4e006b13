#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/robust_statistics.h"
#include "host/wrench/fit_solve.h"

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

/// Mean of e^T (V + error)^-1 e / 6 over each block.
std::vector<double> block_chi2(const Problem& problem,
                               const std::vector<std::vector<Prediction>>& held_out,
                               const ErrorModel& error) {
  std::vector<double> out;
  for (const std::vector<Prediction>& block : held_out) {
    double sum = 0;
    for (const Prediction& p : block) sum += chi2_of(problem, p, error, p.error) / 6;
    out.push_back(sum / static_cast<double>(block.size()));
  }
  return out;
}

/// A block that the others contradict, by more than what model errors are for.
bool is_outlier(const Problem& problem, const std::vector<Prediction>& held_out, double chi2) {
  return chi2 > kOutlierChi2 && largest_error(problem, held_out) > kWorthRejecting;
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

/// Assumed of the model's error, and not fitted: one step that is off by its whole load would
/// otherwise pass for a model that is off by a fifth.
struct Hypothesis {
  double model_error;  ///< of full load, at full load
  bool reciprocal;
  double price;  ///< how far-fetched; a wrong step is 1
};
constexpr std::array<Hypothesis, 6> kHypotheses{{
    {0.003, true, 0.0},
    {0.003, false, 0.5},
    {0.01, true, 0.9},
    {0.01, false, 1.4},
    {0.03, true, 1.5},
    {0.03, false, 2.0},
}};
constexpr double kMaxLeftOut = 0.25;  // of the steps with a load
constexpr double kDoubt = 20;         // of chi^2: another step is e^10 times less likely

constexpr double kBroken = 3;  // standard deviations of reciprocity
// Of the geometric mean of two stiffnesses. Friction makes some hundredths; this is a load that is
// not what the plan says.
constexpr double kGrossAsymmetry = 0.2;

/// The problem with one block a step.
Problem by_steps(const Problem& problem) {
  Problem out = problem;
  out.blocks.clear();
  for (const Block& block : problem.blocks) {
    if (out.blocks.empty() || out.blocks.back().step != block.step) {
      out.blocks.push_back(block);
    } else {
      Block& step = out.blocks.back();
      step.to = block.to;
      step.members.insert(step.members.end(), block.members.begin(), block.members.end());
    }
    for (const std::size_t i : block.members)
      out.rows[i].block = static_cast<int>(out.blocks.size()) - 1;
  }
  return out;
}

std::size_t most_left_out(const Problem& steps) {
  const auto loaded =
      std::count_if(steps.blocks.begin(), steps.blocks.end(),
                    [&](const Block& step) { return steps.rows[step.members.front()].load > 0; });
  return static_cast<std::size_t>(kMaxLeftOut * static_cast<double>(loaded));
}

struct Attempt {
  bool settled = false;
  std::vector<double> weight;  ///< of each step: 0 or 1
  std::size_t left_out = 0;
};

/// Takes out the step that the others predict worst, until all that are left agree: by the largest
/// likelihood of what remains, with the step's own wrench as unknown.
Attempt take_out(const Problem& steps, double model_error, std::size_t most) {
  Attempt out;
  Weighting weighting = equal_weights(
      steps, {kConstantFraction * model_error * steps.scale, model_error * steps.scale});
  Eigen::VectorXd start;
  double margin = std::numeric_limits<double>::infinity();  // between the last one and the next
  for (;; ++out.left_out) {
    const Solution solution = solve(steps, weighting, start);
    start = solution.unknowns;
    const auto held_out = hold_out(steps, solution);
    const std::vector<double> chi2 = block_chi2(steps, held_out, weighting.error);
    double largest = 0, second = 0;
    std::size_t worst = 0;
    for (std::size_t b = 0; b < chi2.size(); ++b) {
      if (weighting.block[b] == 0 || !is_outlier(steps, held_out[b], chi2[b])) continue;
      if (chi2[b] > largest) {
        second = largest;
        largest = chi2[b];
        worst = b;
      } else {
        second = std::max(second, chi2[b]);
      }
    }
    if (largest == 0) {
      out.settled = margin > kDoubt;
      out.weight = weighting.block;
      return out;
    }
    if (out.left_out >= most) return out;
    margin = 6 * (largest - second);
    weighting.block[worst] = 0;
  }
}

/// The pair of axes whose cross terms differ most.
struct Asymmetry {
  int one = 0, other = 0;
  double off = 0;       ///< in standard deviations of what is known of it and assumed
  double relative = 0;  ///< of the geometric mean of the two stiffnesses
};

Asymmetry asymmetry_of(const Matrix6& reciprocity, const Judged& judged, bool assumed) {
  const Matrix6 K = judged.solution.stiffness();
  Asymmetry out;
  const Eigen::MatrixXd& C = judged.solution.covariance;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      const double sigma = reciprocity(i, j);
      if (sigma == 0) continue;
      const int a = 6 * j + i, b = 6 * i + j;
      const double known = assumed ? 0 : C(a, a) + C(b, b) - 2 * C(a, b);
      const double difference = std::abs(K(i, j) - K(j, i));
      const double off = difference / std::sqrt(sigma * sigma + known);
      if (off <= out.off) continue;
      out = {j, i, off, difference / std::sqrt(std::abs(K(i, i) * K(j, j)))};
    }
  }
  return out;
}

/// "step 3, step 10"; empty if none was left out.
std::string left_out_steps(const Problem& problem, const std::vector<bool>& left_out) {
  std::vector<std::string> out;
  for (std::size_t b = 0; b < left_out.size(); ++b) {
    if (!left_out[b]) continue;
    std::string step = fmt::format("step {}", problem.blocks[b].step + 1);
    if (out.empty() || out.back() != step) out.push_back(std::move(step));
  }
  return fmt::format("{}", fmt::join(out, ", "));
}

}  // namespace

double chi2_of(const Problem& problem, const Prediction& held_out, const ErrorModel& model,
               const Vector6& error) {
  Matrix6 S = held_out.covariance;
  S.diagonal() += model.variance(problem.rows[held_out.row].load);
  return error.dot(S.llt().solve(error));
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

Explanation explain(const Problem& problem) {
  Problem steps = by_steps(problem);
  const Matrix6 reciprocity = steps.reciprocity;
  const std::size_t most = most_left_out(steps);
  Explanation out{.left_out = std::vector<bool>(problem.blocks.size(), false)};
  double best = static_cast<double>(most) + kHypotheses.back().price + 1;
  for (const Hypothesis& hypothesis : kHypotheses) {
    if (hypothesis.price >= best) break;
    if (!hypothesis.reciprocal && reciprocity.isZero(0)) continue;
    steps.reciprocity = hypothesis.reciprocal ? reciprocity : Matrix6::Zero();
    const auto worthwhile = static_cast<std::size_t>(best - hypothesis.price);
    const Attempt attempt = take_out(steps, hypothesis.model_error, std::min(most, worthwhile));
    const double price = hypothesis.price + static_cast<double>(attempt.left_out);
    if (!attempt.settled || price >= best) continue;
    best = price;
    out.found = true;
    out.reciprocal = hypothesis.reciprocal;
    for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
      const auto step = static_cast<std::size_t>(steps.rows[problem.blocks[b].members[0]].block);
      out.left_out[b] = attempt.weight[step] == 0;
    }
  }
  return out;
}

Judged judge_explained(Problem& problem, const Explanation& explanation,
                       std::vector<std::string>& warnings) {
  const Matrix6 reciprocity = problem.reciprocity;
  if (explanation.reciprocal) {
    Judged judged = judge(problem, explanation.left_out);
    if (asymmetry_of(reciprocity, judged, true).off <= kBroken) return judged;
  }
  problem.reciprocity.setZero();
  Judged judged = judge(problem, explanation.left_out);
  const Asymmetry asymmetry = asymmetry_of(reciprocity, judged, false);
  const std::string pair =
      fmt::format("{} and {}", wrench_axis(asymmetry.one), wrench_axis(asymmetry.other));
  const std::string suspects = left_out_steps(problem, explanation.left_out);
  if (!explanation.found || !suspects.empty() || asymmetry.relative > kGrossAsymmetry) {
    throw ConfigError(
        "calibration: the steps contradict each other: K would not be symmetric by {:.0f} % ({}), "
        "as springs' is; check masses, points and directions of the plan{}, and that nothing rubs, "
        "then take the steps again",
        100 * asymmetry.relative, pair,
        suspects.empty() ? "" : fmt::format(" (suspect: {})", suspects));
  }
  warnings.push_back(fmt::format(
      "K is not symmetric by {:.0f} standard deviations ({}), as springs' is; fitted without that "
      "assumption: check points and directions of the plan, and that nothing rubs",
      asymmetry.off, pair));
  return judged;
}

}  // namespace tagwrench::fit
