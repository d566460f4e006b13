// What a calibration is worth on data that it has not seen: blocks in time, whole steps, or whole
// trials are held out, never random points, whose neighbours would give them away. The lag is found
// without the data held out, as everything else is.
#include "host/calibration/analysis/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "host/calibration/analysis/analysis_steps.h"
#include "host/core/config_error.h"

namespace tagwrench::study {
namespace {

constexpr double kMinSpread = 1.5;  // of the reference's noise: it alone has 1

void check_options(const AnalysisOptions& options) {
  if (options.folds < 2) throw ConfigError("--folds: at least 2, so that something is held out");
  if (options.hold_out < 0 || options.hold_out > 0.9)
    throw ConfigError("--hold-out: a share from 0 to 0.9");
  if (!(options.lag_to > options.lag_from))
    throw ConfigError("--lag-from and --lag-to: the first must be the smaller one");
}

/// The file, where it came from one: two files may bear one name.
const std::string& called(const Trial& trial) {
  return trial.file.empty() ? trial.name : trial.file;
}

/// Two of one would not hold anything out; those of two sensors have no stiffness in common.
void check_apart(const Trial& a, const Trial& b) {
  const bool same_shape =
      a.time.size() == b.time.size() && a.reference.size() == b.reference.size();
  if (same_shape && a.time == b.time && a.features == b.features && a.reference == b.reference)
    throw ConfigError("{} and {}: are the same data twice; name each once", called(a), called(b));
  if (!a.sensor.empty() && !b.sensor.empty() && a.sensor != b.sensor) {
    throw ConfigError(
        "{} and {}: are of different sensors, or of one whose camera or target was calibrated "
        "between them; analyze them one by one",
        called(a), called(b));
  }
}

void check_together(const std::vector<Trial>& trials) {
  if (trials.empty()) throw ConfigError("nothing to analyze: name a file");
  for (const Trial& trial : trials) {
    if (trial.feature_names != trials[0].feature_names) {
      throw ConfigError("{} and {}: their features differ ({} and {}); analyze them one by one",
                        called(trials[0]), called(trial), fmt::join(trials[0].feature_names, " "),
                        fmt::join(trial.feature_names, " "));
    }
  }
  for (std::size_t b = 1; b < trials.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) check_apart(trials[a], trials[b]);
}

bool usable(const CleanTrial& trial, Eigen::Index i) {
  return trial.step.size() == 0 || trial.step[i] >= 0;
}

bool continues(const CleanTrial& trial, Eigen::Index i, double longest) {
  return usable(trial, i) == usable(trial, i - 1) &&
         (trial.step.size() == 0 || trial.step[i] == trial.step[i - 1]) &&
         trial.time[i] - trial.time[i - 1] <= longest;
}

/// All readings that count: those of steps, where there are steps.
std::vector<Range> usable_ranges(const std::vector<CleanTrial>& trials) {
  std::vector<Range> ranges;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const CleanTrial& trial = trials[t];
    const double longest = kGapsOfMedian * median_interval(trial.time);
    for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
      if (!usable(trial, i)) continue;
      if (i > 0 && continues(trial, i, longest))
        ++ranges.back().count;
      else
        ranges.push_back({t, i, 1});
    }
  }
  return ranges;
}

struct FoldPlan {
  std::vector<Range> held_out, learned;
};

struct FoldPlans {
  std::vector<FoldPlan> folds;
  std::string description;
};

/// The readings of a trial from `first` up to, without, `end` are held out.
FoldPlan block(const CleanTrial& trial, const std::vector<Range>& ranges, Eigen::Index first,
               Eigen::Index end, double guard) {
  FoldPlan plan;
  const auto add = [](const Range& range, Eigen::Index from, Eigen::Index to,
                      std::vector<Range>& ranges_of_plan) {
    from = std::max(from, range.first);
    to = std::min(to, range.first + range.count);
    if (to > from) ranges_of_plan.push_back({range.trial, from, to - from});
  };
  Eigen::Index before = first, after = end;
  while (before > 0 && trial.time[before - 1] > trial.time[first] - guard) --before;
  while (after < trial.time.size() && trial.time[after] < trial.time[end - 1] + guard) ++after;
  for (const Range& range : ranges) {
    add(range, first, end, plan.held_out);
    add(range, 0, before, plan.learned);
    add(range, after, trial.time.size(), plan.learned);
  }
  return plan;
}

FoldPlans time_blocks(const CleanTrial& trial, const std::vector<Range>& ranges,
                      const AnalysisOptions& options) {
  FoldPlans plans;
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

/// Several trials: each is held out once. One with steps: each step. Else blocks in time, or the
/// end.
FoldPlans plan_folds(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
                     const AnalysisOptions& options) {
  const bool several = trials.size() > 1;
  const Eigen::VectorXi& step = trials[0].step;
  if (!several && (step.size() == 0 || step.maxCoeff() <= 0 || options.hold_out > 0))
    return time_blocks(trials[0], ranges, options);
  const auto group = [&](const Range& range) {
    return several ? static_cast<int>(range.trial) : step[range.first];
  };
  std::set<int> groups;
  for (const Range& range : ranges) groups.insert(group(range));
  FoldPlans plans{{}, fmt::format("each of {} {}", groups.size(), several ? "trials" : "steps")};
  for (const int held_out : groups) {
    FoldPlan& plan = plans.folds.emplace_back();
    for (const Range& range : ranges)
      (group(range) == held_out ? plan.held_out : plan.learned).push_back(range);
  }
  return plans;
}

Eigen::MatrixXd features_of(const CleanTrial& trial, const Range& range, bool smooth,
                            bool in_context) {
  if (!smooth) return trial.features.middleRows(range.first, range.count);
  const double longest = kGapsOfMedian * median_interval(trial.time);
  const Eigen::Index end = range.first + range.count;
  const bool before = in_context && range.first > 0 && continues(trial, range.first, longest);
  const bool after = in_context && end < trial.time.size() && continues(trial, end, longest);
  return smooth_rows(trial.features.middleRows(range.first - before, range.count + before + after))
      .middleRows(before, range.count);
}

Rows only(const Rows& rows, const std::vector<Eigen::Index>& kept) {
  std::vector<Eigen::Index> predicted;
  if (rows.predicted.rows() > 0) predicted = kept;
  return {
      rows.time(kept),    rows.features(kept, Eigen::all),       rows.felt(kept, Eigen::all),
      rows.segment(kept), rows.predicted(predicted, Eigen::all), rows.sigma(predicted, Eigen::all)};
}

/// What the trials brought counts only where all of them did.
bool brings_predictions(const std::vector<CleanTrial>& trials) {
  return std::all_of(trials.begin(), trials.end(),
                     [](const CleanTrial& trial) { return trial.predicted.size() > 0; });
}

/// Adds rows with their predictions to the held-out series of the analysis.
void add_held_out(const Rows& rows, Analysis& analysis) {
  const auto append = [](auto& all, const auto& more) {
    all.conservativeResize(all.rows() + more.rows(), more.cols());
    all.bottomRows(more.rows()) = more;
  };
  const int segments = analysis.segment.size() > 0 ? analysis.segment.maxCoeff() + 1 : 0;
  append(analysis.time, rows.time);
  append(analysis.predicted, rows.predicted);
  append(analysis.predicted_sigma, rows.sigma);
  append(analysis.felt, rows.felt);
  append(analysis.segment, (rows.segment.array() + segments).matrix());
}

/// Throws ConfigError if a fold leaves too little to learn from.
void cross_validate(const std::vector<CleanTrial>& trials, const std::vector<FoldPlan>& folds,
                    const AnalysisOptions& options, Analysis& analysis) {
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const FoldPlan& plan = folds[f];
    Fold fold;
    fold.lag = lag_of(trials, plan.learned, options);
    fold.lag_sought = std::any_of(plan.learned.begin(), plan.learned.end(),
                                  [&](const Range& r) { return !trials[r.trial].held; });
    const Rows learned = rows_of(trials, plan.learned, fold.lag.value, options.smooth);
    if (learned.time.size() <= learned.features.cols() + 1) {
      throw ConfigError(
          "fold {} of {}: {} readings are left to learn {} numbers per axis from; record more, or "
          "use fewer folds",
          f + 1, folds.size(), learned.time.size(), learned.features.cols() + 1);
    }
    const LinearModel model = fit_linear(learned.features, learned.felt, options.ridge);
    Rows rows = rows_of(trials, plan.held_out, fold.lag.value, options.smooth, /*in_context=*/true);
    if (rows.time.size() == 0) continue;
    rows.predicted = model.predict(rows.features);
    rows.sigma = model.sigma(rows.features);
    fold.trial = plan.held_out.front().trial;
    fold.from = rows.time.minCoeff();
    fold.to = rows.time.maxCoeff();
    const Eigen::VectorXd r2 = r_squared(rows.predicted, rows.felt);
    const Eigen::VectorXd rmse = rms_error(rows.predicted, rows.felt);
    for (int k = 0; k < 6; ++k) {
      // Where the reference does no more than waver, the share that is explained is no figure of
      // the sensor.
      const bool moves =
          standard_deviation(rows.felt.col(k)) > kMinSpread * trials[fold.trial].noise[k];
      fold.r2[k] = moves ? r2[k] : kNaN;
      fold.rmse[k] = rmse[k];
    }
    analysis.folds.push_back(fold);
    add_held_out(rows, analysis);
  }
}

void describe(const std::vector<CleanTrial>& trials, Analysis& analysis) {
  analysis.feature_names = trials[0].feature_names;
  double reading_period = 0, reference_period = 0;
  for (const CleanTrial& trial : trials) {
    analysis.names.push_back(trial.name);
    analysis.references += trial.reference_time.size();
    analysis.seconds += trial.time[trial.time.size() - 1] - trial.time[0];
    reading_period = std::max(reading_period, median_interval(trial.time));
    if (!trial.held)
      reference_period = std::max(reference_period, median_interval(trial.reference_time));
    for (int k = 0; k < 6; ++k) {
      double& step = analysis.axis[k].reference_step;
      step = std::max(step, trial.quantum[k]);
    }
  }
  if (reading_period > 0) analysis.reading_rate = 1 / reading_period;
  if (reference_period > 0) analysis.reference_rate = 1 / reference_period;
}

}  // namespace

Rows rows_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges, double lag,
             bool smooth, bool in_context) {
  const Eigen::Index all =
      std::accumulate(ranges.begin(), ranges.end(), Eigen::Index{0},
                      [](Eigen::Index sum, const Range& range) { return sum + range.count; });
  const bool predictions = brings_predictions(trials);
  Rows rows{Eigen::VectorXd(all),
            Eigen::MatrixXd(all, trials[0].features.cols()),
            Eigen::MatrixXd(all, 6),
            Eigen::VectorXi(all),
            Eigen::MatrixXd(predictions ? all : 0, 6),
            Eigen::MatrixXd(predictions ? all : 0, 6)};
  std::vector<Eigen::Index> felt;
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    const auto& [number, first, count] = ranges[r];
    const CleanTrial& trial = trials[number];
    rows.time.segment(at, count) = trial.time.segment(first, count);
    rows.features.middleRows(at, count) = features_of(trial, ranges[r], smooth, in_context);
    rows.felt.middleRows(at, count) =
        reference_at(rows.time.segment(at, count), trial.held ? 0 : lag, trial.reference_time,
                     trial.reference, trial.longest_gap);
    rows.segment.segment(at, count).setConstant(static_cast<int>(r));
    if (predictions) {
      rows.predicted.middleRows(at, count) = trial.predicted.middleRows(first, count);
      rows.sigma.middleRows(at, count) = trial.predicted_sigma.middleRows(first, count);
    }
    for (const Eigen::Index end = at + count; at < end; ++at)
      if (rows.felt.row(at).allFinite()) felt.push_back(at);
  }
  return only(rows, felt);
}

Lag lag_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
           const AnalysisOptions& options, int axis) {
  std::vector<Segment> segments;
  for (const auto& [number, first, count] : ranges) {
    const CleanTrial& trial = trials[number];
    if (trial.held) continue;
    Segment& segment = segments.emplace_back();
    segment.time = trial.time.segment(first, count);
    segment.features = features_of(trial, {number, first, count}, options.smooth, false);
    // From one row of the reference before what any lag asks for to one after it.
    const double* begin = trial.reference_time.data();
    const double* end = begin + trial.reference_time.size();
    const double* from = std::lower_bound(begin, end, segment.time[0] - options.lag_to);
    const double* to = std::upper_bound(begin, end, segment.time[count - 1] - options.lag_from);
    if (from > begin) --from;
    if (to < end) ++to;
    segment.reference_time = trial.reference_time.segment(from - begin, to - from);
    const auto reference = trial.reference.middleRows(from - begin, to - from);
    segment.reference = axis < 0 ? Eigen::MatrixXd(reference) : reference.col(axis);
  }
  Lag lag;
  lag.known = true;
  if (segments.empty()) return lag;
  return estimate_lag(segments, {options.lag_from, options.lag_to,
                                 std::max(LagSearch().ridge, options.ridge), !options.smooth});
}

Analysis analyze(const std::vector<Trial>& trials, const AnalysisOptions& options) {
  check_options(options);
  check_together(trials);
  Analysis analysis;
  std::vector<CleanTrial> clean;
  for (const Trial& trial : trials) clean.push_back(check_trial(trial, options, analysis.warnings));
  describe(clean, analysis);

  const std::vector<Range> all = usable_ranges(clean);
  analysis.lag = lag_of(clean, all, options);
  Rows rows = rows_of(clean, all, analysis.lag.value, options.smooth);
  analysis.readings = rows.time.size();
  if (rows.time.size() <= rows.features.cols() + 1) {
    throw ConfigError(
        "{}: {} readings with a reference for {} unknown numbers per axis; record more, or check "
        "the units of time",
        trials[0].name, rows.time.size(), rows.features.cols() + 1);
  }
  Eigen::VectorXd noise = clean[0].noise;
  for (const CleanTrial& trial : clean) noise = noise.cwiseMax(trial.noise);
  judge_excitation(rows.felt, noise, analysis);

  const LinearModel model = fit_linear(rows.features, rows.felt, options.ridge);
  analysis.matrix = model.matrix();
  analysis.offset = model.constant();
  analysis.condition = model.condition;
  if (brings_predictions(clean)) {
    analysis.own_predictions = true;
    analysis.validation = "each step, by the calibration's own fit without it";
    std::vector<Eigen::Index> there;
    for (Eigen::Index i = 0; i < rows.time.size(); ++i)
      if (rows.predicted.row(i).allFinite() && rows.sigma.row(i).allFinite()) there.push_back(i);
    add_held_out(only(rows, there), analysis);
  } else {
    const FoldPlans plans = plan_folds(clean, all, options);
    analysis.validation = plans.description + ", predicted from the rest";
    cross_validate(clean, plans.folds, options, analysis);
  }
  if (analysis.time.size() == 0)
    throw ConfigError("{}: nothing could be held out; record more", trials[0].name);
  measure_held_out(analysis);
  rows.predicted = model.predict(rows.features);
  const Eigen::VectorXd in_sample = r_squared(rows.predicted, rows.felt);
  for (int k = 0; k < 6; ++k) analysis.axis[k].r2_in_sample = in_sample[k];
  measure_rest(rows, trials.size() == 1, analysis);
  add_warnings(clean, rows, options, analysis);
  return analysis;
}

}  // namespace tagwrench::study
