#include "host/calibration/analysis/cross_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "host/calibration/analysis/lag.h"
#include "host/core/config_error.h"

namespace tagwrench::study {
namespace {

constexpr double kGapsOfMedian = 5;  // between readings, that end a segment
constexpr double kMinSpread = 1.5;   // of the reference's noise: it alone has 1

bool usable(const CleanTrial& trial, Eigen::Index i) {
  return trial.step.size() == 0 || trial.step[i] >= 0;
}

bool continues(const CleanTrial& trial, Eigen::Index i, double longest) {
  return usable(trial, i) == usable(trial, i - 1) &&
         (trial.step.size() == 0 || trial.step[i] == trial.step[i - 1]) &&
         trial.time[i] - trial.time[i - 1] <= longest;
}

std::vector<Range> ranges_of(const CleanTrial& trial, std::size_t number) {
  std::vector<Range> ranges;
  const double longest = kGapsOfMedian * median_interval(trial.time);
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    if (!usable(trial, i)) continue;
    if (!ranges.empty() && i > 0 && continues(trial, i, longest)) {
      ++ranges.back().count;
    } else {
      ranges.push_back({number, i, 1});
    }
  }
  return ranges;
}

/// What of `ranges` lies in the readings from `first` up to, without, `end`; or outside of them.
std::vector<Range> cut(const std::vector<Range>& ranges, Eigen::Index first, Eigen::Index end,
                       bool inside) {
  std::vector<Range> left;
  const auto add = [&](const Range& range, Eigen::Index from, Eigen::Index to) {
    from = std::max(from, range.first);
    to = std::min(to, range.first + range.count);
    if (to > from) left.push_back({range.trial, from, to - from});
  };
  for (const Range& range : ranges) {
    if (inside) {
      add(range, first, end);
    } else {
      add(range, 0, first);
      add(range, end, range.first + range.count);
    }
  }
  return left;
}

FoldPlan block(const CleanTrial& trial, const std::vector<Range>& ranges, Eigen::Index first,
               Eigen::Index end, double guard) {
  FoldPlan plan;
  plan.held_out = cut(ranges, first, end, true);
  const double from = trial.time[first] - guard;
  const double to = trial.time[end - 1] + guard;
  while (first > 0 && trial.time[first - 1] > from) --first;
  while (end < trial.time.size() && trial.time[end] < to) ++end;
  plan.learned = cut(ranges, first, end, false);
  return plan;
}

FoldPlans time_blocks(const CleanTrial& trial, const AnalysisOptions& options) {
  FoldPlans plans;
  const std::vector<Range> ranges = ranges_of(trial, 0);
  const Eigen::Index n = trial.time.size();
  if (options.hold_out > 0) {
    const auto first = static_cast<Eigen::Index>(static_cast<double>(n) * (1 - options.hold_out));
    plans.folds.push_back(block(trial, ranges, first, n, options.guard));
    plans.description = fmt::format("the last {:.0f} %", 100 * options.hold_out);
    return plans;
  }
  for (int b = 0; b < options.folds; ++b) {
    // The first blocks are one longer where it does not come out even.
    const Eigen::Index longer = n % options.folds;
    const Eigen::Index first = n / options.folds * b + std::min<Eigen::Index>(b, longer);
    const Eigen::Index end = first + n / options.folds + (b < longer ? 1 : 0);
    if (end > first) plans.folds.push_back(block(trial, ranges, first, end, options.guard));
  }
  plans.description = fmt::format("each of {} blocks in time", plans.folds.size());
  return plans;
}

FoldPlans each_step(const CleanTrial& trial) {
  const std::vector<Range> ranges = ranges_of(trial, 0);
  std::set<int> steps;
  for (const Range& range : ranges) steps.insert(trial.step[range.first]);
  FoldPlans plans;
  for (const int step : steps) {
    FoldPlan& plan = plans.folds.emplace_back();
    for (const Range& range : ranges)
      (trial.step[range.first] == step ? plan.held_out : plan.learned).push_back(range);
  }
  plans.description = fmt::format("each of {} steps", steps.size());
  return plans;
}

Eigen::MatrixXd features_of(const CleanTrial& trial, const Range& range, Smoothing smoothing) {
  if (smoothing == Smoothing::none) return trial.features.middleRows(range.first, range.count);
  Range wide = range;
  if (smoothing == Smoothing::in_context) {
    const double longest = kGapsOfMedian * median_interval(trial.time);
    if (wide.first > 0 && continues(trial, wide.first, longest)) {
      --wide.first;
      ++wide.count;
    }
    const Eigen::Index end = wide.first + wide.count;
    if (end < trial.time.size() && continues(trial, end, longest)) ++wide.count;
  }
  return smooth_rows(trial.features.middleRows(wide.first, wide.count))
      .middleRows(range.first - wide.first, range.count);
}

/// The rows of the reference from one before `from` to one after `to`: first, and beyond the last.
std::pair<Eigen::Index, Eigen::Index> reference_rows(const CleanTrial& trial, double from,
                                                     double to) {
  const double* begin = trial.reference_time.data();
  const double* end = begin + trial.reference_time.size();
  const Eigen::Index first = std::lower_bound(begin, end, from) - begin;
  const Eigen::Index last = std::upper_bound(begin, end, to) - begin;
  return {std::max<Eigen::Index>(0, first - 1),
          std::min<Eigen::Index>(trial.reference_time.size(), last + 1)};
}

/// Without those axes on which the reference of a fold, k x 6, does no more than waver: its share
/// that is explained is no figure of the sensor.
std::array<double, 6> r2_of_fold(const Eigen::VectorXd& r2, const Eigen::MatrixXd& felt,
                                 const Eigen::VectorXd& noise) {
  std::array<double, 6> result{};
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double spread = std::sqrt((felt.col(k).array() - felt.col(k).mean()).square().mean());
    result[static_cast<std::size_t>(k)] =
        spread > kMinSpread * noise[k] ? r2[k] : std::numeric_limits<double>::quiet_NaN();
  }
  return result;
}

}  // namespace

std::vector<Range> usable_ranges(const std::vector<CleanTrial>& trials) {
  std::vector<Range> all;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const std::vector<Range> ranges = ranges_of(trials[t], t);
    all.insert(all.end(), ranges.begin(), ranges.end());
  }
  return all;
}

FoldPlans plan_folds(const std::vector<CleanTrial>& trials, const AnalysisOptions& options) {
  if (trials.size() == 1) {
    const CleanTrial& trial = trials[0];
    const bool several_steps =
        trial.step.size() > 0 && trial.step.maxCoeff() > 0 && options.hold_out <= 0;
    return several_steps ? each_step(trial) : time_blocks(trial, options);
  }
  FoldPlans plans;
  plans.folds.resize(trials.size());
  for (const Range& range : usable_ranges(trials)) {
    for (std::size_t t = 0; t < trials.size(); ++t)
      (range.trial == t ? plans.folds[t].held_out : plans.folds[t].learned).push_back(range);
  }
  plans.description = fmt::format("each of {} trials", trials.size());
  return plans;
}

Rows rows_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges, double lag,
             Smoothing smoothing) {
  Rows rows;
  const Eigen::Index most =
      std::accumulate(ranges.begin(), ranges.end(), Eigen::Index{0},
                      [](Eigen::Index sum, const Range& range) { return sum + range.count; });
  rows.time.resize(most);
  rows.features.resize(most, trials[0].features.cols());
  rows.felt.resize(most, 6);
  rows.segment.resize(most);
  const bool predictions = brings_predictions(trials);
  rows.predicted.resize(predictions ? most : 0, 6);
  rows.sigma.resize(predictions ? most : 0, 6);
  Eigen::Index used = 0;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    const Range& range = ranges[r];
    const CleanTrial& trial = trials[range.trial];
    const Eigen::VectorXd time = trial.time.segment(range.first, range.count);
    const Eigen::MatrixXd features = features_of(trial, range, smoothing);
    const Eigen::MatrixXd felt = reference_at(time, trial.held ? 0 : lag, trial.reference_time,
                                              trial.reference, trial.longest_gap);
    for (Eigen::Index i = 0; i < range.count; ++i) {
      if (!felt.row(i).allFinite()) continue;
      rows.time[used] = time[i];
      rows.features.row(used) = features.row(i);
      rows.felt.row(used) = felt.row(i);
      rows.segment[used] = static_cast<int>(r);
      if (predictions) {
        rows.predicted.row(used) = trial.predicted.row(range.first + i);
        rows.sigma.row(used) = trial.predicted_sigma.row(range.first + i);
      }
      ++used;
    }
  }
  rows.time.conservativeResize(used);
  rows.features.conservativeResize(used, Eigen::NoChange);
  rows.felt.conservativeResize(used, Eigen::NoChange);
  rows.segment.conservativeResize(used);
  if (predictions) {
    rows.predicted.conservativeResize(used, Eigen::NoChange);
    rows.sigma.conservativeResize(used, Eigen::NoChange);
  }
  return rows;
}

Lag lag_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
           const AnalysisOptions& options) {
  std::vector<Segment> segments;
  for (const Range& range : ranges) {
    const CleanTrial& trial = trials[range.trial];
    if (trial.held) continue;
    Segment segment;
    segment.time = trial.time.segment(range.first, range.count);
    segment.features = trial.features.middleRows(range.first, range.count);
    if (options.smooth) segment.features = smooth_rows(segment.features);
    const auto [begin, end] = reference_rows(trial, segment.time[0] - options.lag_to,
                                             segment.time[range.count - 1] - options.lag_from);
    segment.reference_time = trial.reference_time.segment(begin, end - begin);
    segment.reference = trial.reference.middleRows(begin, end - begin);
    segments.push_back(std::move(segment));
  }
  Lag lag;
  lag.known = true;
  if (segments.empty() || !options.fit_lag) return lag;
  LagSearch search;
  search.from = options.lag_from;
  search.to = options.lag_to;
  search.ridge = std::max(search.ridge, options.ridge);
  search.smooth = !options.smooth;
  return estimate_lag(segments, search);
}

bool brings_predictions(const std::vector<CleanTrial>& trials) {
  return std::all_of(trials.begin(), trials.end(),
                     [](const CleanTrial& trial) { return trial.predicted.size() > 0; });
}

HeldOut brought_predictions(const Rows& rows) {
  std::vector<Eigen::Index> there;
  for (Eigen::Index i = 0; i < rows.time.size(); ++i) {
    if (rows.predicted.row(i).allFinite() && rows.sigma.row(i).allFinite()) there.push_back(i);
  }
  HeldOut result;
  result.time = rows.time(there);
  result.predicted = rows.predicted(there, Eigen::all);
  result.sigma = rows.sigma(there, Eigen::all);
  result.felt = rows.felt(there, Eigen::all);
  result.segment = rows.segment(there);
  return result;
}

HeldOut cross_validate(const std::vector<CleanTrial>& trials, const FoldPlans& plans,
                       const AnalysisOptions& options) {
  HeldOut result;
  std::vector<Rows> tested;
  std::vector<Eigen::MatrixXd> predicted;
  std::vector<Eigen::MatrixXd> sigma;
  Eigen::Index total = 0;
  for (std::size_t f = 0; f < plans.folds.size(); ++f) {
    const FoldPlan& plan = plans.folds[f];
    Fold fold;
    fold.lag = lag_of(trials, plan.learned, options);
    fold.lag_sought =
        options.fit_lag && std::any_of(plan.learned.begin(), plan.learned.end(),
                                       [&](const Range& r) { return !trials[r.trial].held; });
    const bool smooth = options.smooth;
    const Rows learned =
        rows_of(trials, plan.learned, fold.lag.value, smooth ? Smoothing::apart : Smoothing::none);
    if (learned.time.size() <= learned.features.cols() + 1) {
      throw ConfigError(fmt::format(
          "fold {} of {}: {} readings are left to learn {} numbers per axis from; record more, or "
          "use fewer folds",
          f + 1, plans.folds.size(), learned.time.size(), learned.features.cols() + 1));
    }
    const LinearModel model = fit_linear(learned.features, learned.felt, options.ridge);
    Rows rows = rows_of(trials, plan.held_out, fold.lag.value,
                        smooth ? Smoothing::in_context : Smoothing::none);
    if (rows.time.size() == 0) continue;
    predicted.push_back(model.predict(rows.features));
    sigma.push_back(model.sigma(rows.features));
    fold.trial = plan.held_out.front().trial;
    fold.from = rows.time.minCoeff();
    fold.to = rows.time.maxCoeff();
    const Eigen::VectorXd r2 = r_squared(predicted.back(), rows.felt);
    const Eigen::VectorXd rmse = rms_error(predicted.back(), rows.felt);
    fold.r2 = r2_of_fold(r2, rows.felt, trials[fold.trial].noise);
    std::copy(rmse.begin(), rmse.end(), fold.rmse.begin());
    result.folds.push_back(fold);
    total += rows.time.size();
    tested.push_back(std::move(rows));
  }
  result.time.resize(total);
  result.predicted.resize(total, 6);
  result.sigma.resize(total, 6);
  result.felt.resize(total, 6);
  result.segment.resize(total);
  Eigen::Index at = 0;
  int segments = 0;
  for (std::size_t f = 0; f < tested.size(); ++f) {
    const Eigen::Index n = tested[f].time.size();
    result.time.segment(at, n) = tested[f].time;
    result.predicted.middleRows(at, n) = predicted[f];
    result.sigma.middleRows(at, n) = sigma[f];
    result.felt.middleRows(at, n) = tested[f].felt;
    result.segment.segment(at, n) = tested[f].segment.array() + segments;
    segments += tested[f].segment.maxCoeff() + 1;
    at += n;
  }
  return result;
}

}  // namespace tagwrench::study
