#include "host/calibration/analysis/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/calibration/analysis/analysis_warnings.h"
#include "host/calibration/analysis/cross_validation.h"
#include "host/calibration/analysis/lag.h"
#include "host/calibration/analysis/metrics.h"
#include "host/core/config_error.h"

namespace tagwrench::study {
namespace {

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
  if (same_shape && a.time == b.time && a.features == b.features && a.reference == b.reference) {
    throw ConfigError(
        fmt::format("{} and {}: are the same data twice; name each once", called(a), called(b)));
  }
  if (!a.sensor.empty() && !b.sensor.empty() && a.sensor != b.sensor) {
    throw ConfigError(fmt::format(
        "{} and {}: are of different sensors, or of one whose camera or target was calibrated "
        "between them; analyze them one by one",
        called(a), called(b)));
  }
}

void check_features(const std::vector<Trial>& trials) {
  if (trials.empty()) throw ConfigError("nothing to analyze: name a file");
  for (const Trial& trial : trials) {
    if (trial.feature_names != trials[0].feature_names) {
      throw ConfigError(
          fmt::format("{} and {}: their features differ ({} and {}); analyze them one by one",
                      called(trials[0]), called(trial), fmt::join(trials[0].feature_names, " "),
                      fmt::join(trial.feature_names, " ")));
    }
  }
  for (std::size_t b = 1; b < trials.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) check_apart(trials[a], trials[b]);
  }
}

Eigen::VectorXd largest_noise(const std::vector<CleanTrial>& trials) {
  Eigen::VectorXd noise = Eigen::VectorXd::Zero(6);
  for (const CleanTrial& trial : trials) noise = noise.cwiseMax(trial.noise);
  return noise;
}

void describe(const std::vector<Trial>& trials, const std::vector<CleanTrial>& clean,
              Analysis& analysis) {
  analysis.feature_names = trials[0].feature_names;
  double reading_period = 0;
  double reference_period = 0;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    analysis.names.push_back(trials[t].name);
    analysis.references += static_cast<std::size_t>(clean[t].reference_time.size());
    analysis.seconds += clean[t].time[clean[t].time.size() - 1] - clean[t].time[0];
    reading_period = std::max(reading_period, median_interval(clean[t].time));
    if (!clean[t].held)
      reference_period = std::max(reference_period, median_interval(clean[t].reference_time));
  }
  if (reading_period > 0) analysis.reading_rate = 1 / reading_period;
  if (reference_period > 0) analysis.reference_rate = 1 / reference_period;
}

/// Rows in order of trial and time.
void keep_held_out(HeldOut&& held_out, Analysis& analysis) {
  analysis.folds = std::move(held_out.folds);
  analysis.time = std::move(held_out.time);
  analysis.predicted = std::move(held_out.predicted);
  analysis.predicted_sigma = std::move(held_out.sigma);
  analysis.felt = std::move(held_out.felt);
  analysis.segment = std::move(held_out.segment);
}

}  // namespace

Analysis analyze(const std::vector<Trial>& trials, const AnalysisOptions& options) {
  check_options(options);
  check_features(trials);
  Analysis analysis;
  std::vector<CleanTrial> clean;
  for (const Trial& trial : trials) clean.push_back(check_trial(trial, options, analysis.warnings));
  describe(trials, clean, analysis);

  const std::vector<Range> all = usable_ranges(clean);
  analysis.lag = lag_of(clean, all, options);
  const Rows rows =
      rows_of(clean, all, analysis.lag.value, options.smooth ? Smoothing::apart : Smoothing::none);
  analysis.readings = static_cast<std::size_t>(rows.time.size());
  if (rows.time.size() <= rows.features.cols() + 1) {
    throw ConfigError(fmt::format(
        "{}: {} readings with a reference for {} unknown numbers per axis; record more, or "
        "check the units of time",
        trials[0].name, rows.time.size(), rows.features.cols() + 1));
  }
  judge_excitation(rows.felt, largest_noise(clean), analysis);
  for (const CleanTrial& trial : clean) {
    for (std::size_t k = 0; k < 6; ++k) {
      double& step = analysis.axis[k].reference_step;
      step = std::max(step, trial.quantum[static_cast<Eigen::Index>(k)]);
    }
  }

  const LinearModel model = fit_linear(rows.features, rows.felt, options.ridge);
  analysis.matrix = model.matrix();
  analysis.offset = model.constant();
  analysis.condition = model.condition;
  const Eigen::VectorXd in_sample = r_squared(model.predict(rows.features), rows.felt);
  for (std::size_t k = 0; k < 6; ++k)
    analysis.axis[k].r2_in_sample = in_sample[static_cast<Eigen::Index>(k)];

  if (brings_predictions(clean)) {
    analysis.own_predictions = true;
    analysis.validation = "each step, by the calibration's own fit without it";
    keep_held_out(brought_predictions(rows), analysis);
  } else {
    const FoldPlans plans = plan_folds(clean, options);
    analysis.validation = plans.description + ", predicted from the rest";
    keep_held_out(cross_validate(clean, plans, options), analysis);
  }
  if (analysis.time.size() == 0)
    throw ConfigError(fmt::format("{}: nothing could be held out; record more", trials[0].name));
  measure_held_out(analysis);
  measure_rest({rows.time, model.predict(rows.features), rows.felt, rows.segment},
               1 / analysis.reading_rate, trials.size() == 1, analysis);
  add_warnings(clean, all, options, analysis);
  return analysis;
}

}  // namespace tagwrench::study
