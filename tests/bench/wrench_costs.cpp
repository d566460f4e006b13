#include "tests/bench/wrench_costs.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/wrench/estimate.h"
#include "host/wrench/fit.h"
#include "tests/bench/tracker_run.h"
#include "tests/bench/wrench_scores.h"

namespace tagwrench::bench {
namespace {

constexpr int kFolds = 5;
constexpr double kForceSigma = 1e-6;   // N, of the ideal reference: that of interpolation
constexpr double kTorqueSigma = 1e-8;  // N m
constexpr double kMaxUsPerSample = 2;

std::vector<Observation> observations_of(const Readings& readings, const ReferenceRecord& reference,
                                         double lag) {
  const auto count = static_cast<Eigen::Index>(readings.time.size());
  const Eigen::VectorXd time = Eigen::VectorXd::Map(readings.time.data(), count);
  const Eigen::MatrixXd felt =
      study::reference_at(time, lag, reference.time, reference.wrench, /*longest_gap=*/0.1);
  std::vector<Observation> result;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!felt.row(i).allFinite()) continue;
    const auto at = static_cast<std::size_t>(i);
    Observation o;
    o.time = time[i];
    o.displacement = readings.displacement[at];
    o.displacement_covariance = readings.covariance[at];
    o.wrench = felt.row(i).transpose();
    o.wrench_covariance.diagonal().head<3>().setConstant(kForceSigma * kForceSigma);
    o.wrench_covariance.diagonal().tail<3>().setConstant(kTorqueSigma * kTorqueSigma);
    result.push_back(o);
  }
  return result;
}

Track track_of(const Observation& o) {
  Track track;
  track.status = Status::ok;
  track.displacement = o.displacement;
  track.covariance = o.displacement_covariance;
  return track;
}

FitOptions linear() {
  FitOptions options;
  options.try_richer = false;
  return options;
}

struct HeldOutScore {
  SixFigures r2{}, rmse{};
  SixFigures sigma{};    ///< RMS of what the estimator says
  SixFigures covered{};  ///< share of errors within 1.96 sigma, %
};

HeldOutScore held_out(const std::vector<Observation>& all) {
  Vector6 squares = Vector6::Zero(), covered = Vector6::Zero(), stated = Vector6::Zero();
  Vector6 sum = Vector6::Zero(), sum_squares = Vector6::Zero();
  for (int fold = 0; fold < kFolds; ++fold) {
    const std::size_t from = all.size() * static_cast<std::size_t>(fold) / kFolds;
    const std::size_t to = all.size() * static_cast<std::size_t>(fold + 1) / kFolds;
    std::vector<Observation> others(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(from));
    others.insert(others.end(), all.begin() + static_cast<std::ptrdiff_t>(to), all.end());
    WrenchEstimator estimator(fit_wrench(others, {}, linear()).model);
    for (std::size_t i = from; i < to; ++i) {
      Sample sample;
      estimator.estimate(track_of(all[i]), sample);
      const Vector6 error = sample.wrench - all[i].wrench;
      squares += error.cwiseAbs2();
      stated += sample.wrench_sigma.cwiseAbs2();
      covered +=
          (error.array().abs() <= 1.96 * sample.wrench_sigma.array()).cast<double>().matrix();
      sum += all[i].wrench;
      sum_squares += all[i].wrench.cwiseAbs2();
    }
  }
  const auto count = static_cast<double>(all.size());
  HeldOutScore score;
  const Vector6 variance = sum_squares / count - (sum / count).cwiseAbs2();
  Vector6::Map(score.r2.data()) = (1 - squares.array() / (count * variance.array())).matrix();
  Vector6::Map(score.rmse.data()) = (squares / count).cwiseSqrt();
  Vector6::Map(score.sigma.data()) = (stated / count).cwiseSqrt();
  Vector6::Map(score.covered.data()) = 100 * covered / count;
  return score;
}

std::vector<PathPoint> path_of(const std::vector<Observation>& all) {
  std::vector<PathPoint> path;
  for (const Observation& o : all) path.push_back({o.time, o.displacement});
  return path;
}

/// The paper's fit: plain least squares, affine.
double plain_fit_us(const std::vector<Observation>& all) {
  const auto count = static_cast<Eigen::Index>(all.size());
  Eigen::MatrixXd from(count, 7), to(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Observation& o = all[static_cast<std::size_t>(i)];
    from.row(i) << 1e3 * o.displacement.transpose(), 1;
    to.row(i) = o.wrench.transpose();
  }
  const double begin = thread_time_us();
  const Eigen::MatrixXd map = from.colPivHouseholderQr().solve(to);
  const double end = thread_time_us();
  return map.allFinite() ? end - begin : std::nan("");
}

template <typename Call>
double median_us(int calls, Call call) {
  constexpr int kBatches = 25;
  std::vector<double> times;
  for (int batch = 0; batch < kBatches; ++batch) {
    const double begin = thread_time_us();
    for (int i = 0; i < calls; ++i) call(i);
    times.push_back((thread_time_us() - begin) / calls);
  }
  std::nth_element(times.begin(), times.begin() + kBatches / 2, times.end());
  return times[kBatches / 2];
}

struct SampleCost {
  double matrix_us = 0;  ///< K d + b alone
  double us = 0;         ///< with every standard deviation
};

SampleCost sample_cost(const WrenchModel& model, const std::vector<Observation>& all) {
  std::vector<Track> tracks;
  for (const Observation& o : all) tracks.push_back(track_of(o));
  WrenchEstimator estimator(model);
  const auto count = static_cast<int>(tracks.size());
  double sink = 0;  // what is never looked at is not computed
  SampleCost cost;
  cost.us = median_us(count, [&](int i) {
    Sample sample;
    estimator.estimate(tracks[static_cast<std::size_t>(i)], sample);
    sink += sample.wrench_sigma.sum() + sample.wrench.sum();
  });
  cost.matrix_us = median_us(count, [&](int i) {
    sink += (model.K * tracks[static_cast<std::size_t>(i)].displacement + model.B).sum();
  });
  return std::isfinite(sink) ? cost : SampleCost{std::nan(""), std::nan("")};
}

void print_held_out(const std::vector<Observation>& all, Table& table) {
  const HeldOutScore score = held_out(all);
  table.columns("five blocks in time, held out", kAxisHeads);
  table.figures("R^2", score.r2, 6);
  table.figures("RMSE, mN and mN m", in_milli(score.rmse), 4);
  table.figures("stated sigma, RMS", in_milli(score.sigma), 4);
  table.figures("errors within 95 % intervals, %", score.covered, 1);
  table.line(
      "The tracker's sigma counts what it does not know of the tags' places, of which the fit");
  table.line("takes up much: what is stated of Fz, Mx and My is rather wide.");
  SixFigures least{}, most{};
  least.fill(90);
  most.fill(99);
  table.at_least("errors within 95 % intervals, %", score.covered, least, 1);
  table.at_most("errors within 95 % intervals, %", score.covered, most, 1);
}

/// The model that it prints the time of.
WrenchModel print_fit_times(const std::vector<Observation>& all, Table& table) {
  const double begin = thread_time_us();
  const WrenchFit fit = fit_wrench(all, {}, linear());
  const double between = thread_time_us();
  const WrenchFit best = fit_wrench(all, path_of(all), {});
  const double end = thread_time_us();
  const double plain_us = plain_fit_us(all);
  table.line("");
  table.line(fmt::format(
      "time to fit {} frames, the linear model: {:.0f} ms; plain least squares: "
      "{:.2f} ms, {:.0f} times less",
      all.size(), 1e-3 * (between - begin), 1e-3 * plain_us, (between - begin) / plain_us));
  table.line(fmt::format("with richer models tried too: {:.0f} ms; adopted: {}",
                         1e-3 * (end - between), name(best.model.features.kind)));
  for (const FeatureKind kind :
       {FeatureKind::quadratic, FeatureKind::creep, FeatureKind::hysteresis}) {
    const ModelTrial* least = nullptr;
    for (const ModelTrial& trial : best.trials) {
      if (trial.features.kind == kind && (least == nullptr || trial.score < least->score))
        least = &trial;
    }
    if (least == nullptr) continue;
    table.line(fmt::format("  {}: {:.3f} +- {:.3f} of the linear model's held-out squared error",
                           name(kind), least->score, least->score_sigma));
  }
  return fit.model;
}

void print_sample_cost(const WrenchModel& model, const std::vector<Observation>& all,
                       double track_us, double usual_us, Table& table) {
  const SampleCost cost = sample_cost(model, all);
  table.line("");
  table.line(
      fmt::format("estimator, per sample: {:.1f} times the bare matrix's {:.3f} us; the "
                  "tracker before it takes {:.0f} us, {:.0f} times as much,",
                  cost.us / cost.matrix_us, cost.matrix_us, track_us, track_us / cost.us));
  table.line(fmt::format("the paper's way to poses {:.0f} us, {:.0f} times as much", usual_us,
                         usual_us / cost.us));
  table.at_most("estimator, per sample", cost.us, kMaxUsPerSample, "us");
}

}  // namespace

void bench_fit(const Readings& readings, const ReferenceRecord& reference, double lag,
               double usual_us, Table& table) {
  table.open(
      "the calibration's own model",
      {"(c) with the ideal reference through the fit and the estimator that `calibrate "
       "wrench` and `run` use:",
       "errors on both sides, an error of the model, a standard deviation for every sample"});
  const std::vector<Observation> all = observations_of(readings, reference, lag);
  print_held_out(all, table);
  print_sample_cost(print_fit_times(all, table), all, readings.median_us, usual_us, table);
}

}  // namespace tagwrench::bench
