#include "host/wrench/fit_consistency.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/wrench/fit_axes.h"

namespace tagwrench::fit {
namespace {

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
  Weighting weighting{
      .error = {kConstantFraction * model_error * steps.scale, model_error * steps.scale},
      .block = std::vector<double>(steps.blocks.size(), 1.0)};
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

Matrix6 stiffness_of(const Judged& judged) {
  return Eigen::Map<const Matrix6>(judged.solution.unknowns.data());
}

/// The pair of axes whose cross terms differ most.
struct Asymmetry {
  std::size_t one = 0, other = 0;
  double off = 0;       ///< in standard deviations of what is known of it and assumed
  double relative = 0;  ///< of the geometric mean of the two stiffnesses
};

Asymmetry asymmetry_of(const Matrix6& reciprocity, const Judged& judged, bool assumed) {
  const Matrix6 K = stiffness_of(judged);
  Asymmetry out;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto row = static_cast<int>(i), column = static_cast<int>(j);
      const double sigma = reciprocity(row, column);
      if (sigma == 0) continue;
      const int a = 6 * column + row, b = 6 * row + column;
      const Eigen::MatrixXd& C = judged.solution.covariance;
      const double known = assumed ? 0 : C(a, a) + C(b, b) - 2 * C(a, b);
      const double difference = std::abs(K(row, column) - K(column, row));
      const double off = difference / std::sqrt(sigma * sigma + known);
      if (off <= out.off) continue;
      out = {j, i, off, difference / std::sqrt(std::abs(K(row, row) * K(column, column)))};
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
      fmt::format("{} and {}", kWrenchAxes[asymmetry.one], kWrenchAxes[asymmetry.other]);
  const std::string suspects = left_out_steps(problem, explanation.left_out);
  if (!explanation.found || !suspects.empty() || asymmetry.relative > kGrossAsymmetry) {
    throw ConfigError(fmt::format(
        "calibration: the steps contradict each other: K would not be symmetric by {:.0f} % ({}), "
        "as springs' is; check masses, points and directions of the plan{}, and that nothing rubs, "
        "then take the steps again",
        100 * asymmetry.relative, pair,
        suspects.empty() ? "" : fmt::format(" (suspect: {})", suspects)));
  }
  warnings.push_back(fmt::format(
      "K is not symmetric by {:.0f} standard deviations ({}), as springs' is; fitted without that "
      "assumption: check points and directions of the plan, and that nothing rubs",
      asymmetry.off, pair));
  return judged;
}

}  // namespace tagwrench::fit
