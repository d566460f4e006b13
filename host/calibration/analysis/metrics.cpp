// What held-out predictions say about an instrument, axis by axis.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/calibration/analysis/analysis_steps.h"
#include "host/core/algebra/decompositions.h"
#include "host/core/axis_names.h"
#include "host/core/robust_statistics.h"

namespace tagwrench::study {
namespace {

/// Eigenvalues of the correlation matrix below this, of the largest, are rounding.
constexpr double kRankTolerance = 1e-12;
constexpr double kRounding = 1e-9;  // of the largest value: less is no change

Eigen::MatrixXd standardised(const LinearModel& model, const Eigen::MatrixXd& features) {
  return (features.rowwise() - model.mean.transpose()) * model.scale.asDiagonal();
}

// Below this the part of an axis' load that others do not tell is the reference's noise.
constexpr double kMinIndependent = 3;
constexpr std::size_t kMinRests = 3;    // windows that tell the noise
constexpr double kUnknownNoise = 1e-9;  // of the range, where the reference has none
constexpr double kMaxExcitation = 1e6;
constexpr int kBins = 10;
constexpr int kMinInBin = 5;
constexpr Eigen::Index kFewRows = 100;  // means of holds: each is a point of its own
constexpr double kQuietSeconds = 1;
constexpr Eigen::Index kMinQuietRows = 10;
constexpr double kQuietShare = 0.005;  // of full scale
constexpr double kRestShare = 0.02;    // of full scale: nobody touches
constexpr double kCreepShare = 0.2;    // of full scale: a load
constexpr double kCreepSeconds = 3;
constexpr double kDriftSeconds = 60;
constexpr double kCrossTalkSigma = 2;  // % of full scale; worse is not told
constexpr double kTwoSided95 = 1.959964;

/// Slope of v over t.
double slope(const Eigen::VectorXd& t, const Eigen::VectorXd& v) {
  const Eigen::ArrayXd centred = t.array() - t.mean();
  const double spread = centred.square().sum();
  return spread > 0 ? (centred * v.array()).sum() / spread : 0;
}

struct Series {
  Eigen::VectorXd felt;
  Eigen::VectorXd error;  ///< predicted - felt
};

/// The largest magnitude of those that are known; NaN if none is.
double largest(const Eigen::VectorXd& values) {
  double most = kNaN;
  for (const double value : values)
    if (std::isfinite(value) && !(std::abs(value) <= most)) most = std::abs(value);
  return most;
}

/// Means of the error in bins of the load; NaN where there are too few.
Eigen::VectorXd binned(const Series& s, const std::vector<Eigen::Index>& rows,
                       const AxisReport& axis) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kBins);
  Eigen::VectorXi count = Eigen::VectorXi::Zero(kBins);
  for (const Eigen::Index i : rows) {
    const double share = (s.felt[i] - axis.range_low) / (axis.range_high - axis.range_low);
    const int bin = std::clamp(static_cast<int>(share * kBins), 0, kBins - 1);
    sum[bin] += s.error[i];
    ++count[bin];
  }
  const int least = s.felt.size() < kFewRows ? 1 : kMinInBin;
  for (int b = 0; b < kBins; ++b) sum[b] = count[b] >= least ? sum[b] / count[b] : kNaN;
  return sum;
}

double nonlinearity(const Series& s, const AxisReport& axis) {
  if (!(axis.range_high > axis.range_low)) return 0;
  std::vector<Eigen::Index> all(s.felt.size());
  std::iota(all.begin(), all.end(), 0);
  const double gain = slope(s.felt, s.error);
  Series about_line = s;
  about_line.error.array() -= s.error.mean() + gain * (s.felt.array() - s.felt.mean());
  return 100 * largest(binned(about_line, all, axis)) / axis.full_scale;
}

double hysteresis(const Series& s, const Eigen::VectorXi& segment, const AxisReport& axis) {
  if (!(axis.range_high > axis.range_low)) return 0;
  std::vector<Eigen::Index> rising, falling;
  for (Eigen::Index i = 1; i + 1 < s.felt.size(); ++i) {
    if (segment[i - 1] != segment[i + 1]) continue;
    const double change = s.felt[i + 1] - s.felt[i - 1];
    if (std::abs(change) <= 3 * axis.reference_noise) continue;
    (change > 0 ? rising : falling).push_back(i);
  }
  return 100 * largest(binned(s, rising, axis) - binned(s, falling, axis)) / axis.full_scale;
}

/// Rows in which the load stands still.
struct Window {
  Eigen::Index first = 0, count = 0;

  Eigen::VectorXd of(const Eigen::VectorXd& column) const { return column.segment(first, count); }
};

std::vector<Window> quiet_windows(const Rows& course, const Analysis& analysis) {
  const Eigen::Index rows =
      std::max<Eigen::Index>(kMinQuietRows, std::lround(kQuietSeconds * analysis.reading_rate));
  std::vector<Window> windows;
  for (Eigen::Index first = 0; first + rows <= course.time.size();) {
    bool quiet = course.segment[first] == course.segment[first + rows - 1];
    for (int k = 0; k < 6 && quiet; ++k) {
      const AxisReport& axis = analysis.axis[k];
      const auto load = course.felt.col(k).segment(first, rows);
      quiet = load.maxCoeff() - load.minCoeff() <=
              std::max(6 * axis.reference_noise, kQuietShare * axis.full_scale);
    }
    if (quiet) windows.push_back({first, rows});
    first += quiet ? rows : std::max<Eigen::Index>(1, rows / 4);
  }
  return windows;
}

/// White noise from neighbours' differences, which drift does not reach: density per root Hz is
/// sqrt(2 period) times the Allan deviation at one period (IEEE Std 952, annex C).
void measure_noise(const Eigen::VectorXd& time, const Eigen::VectorXd& predicted,
                   const std::vector<Window>& windows, double period, AxisReport& axis) {
  double squares = 0, freedom = 0, differences = 0, pairs = 0;
  for (const Window& w : windows) {
    const Eigen::VectorXd t = w.of(time), p = w.of(predicted);
    const Eigen::ArrayXd left = p.array() - p.mean() - slope(t, p) * (t.array() - t.mean());
    squares += left.square().sum();
    freedom += static_cast<double>(w.count - 2);
    differences += (p.tail(w.count - 1) - p.head(w.count - 1)).squaredNorm();
    pairs += static_cast<double>(w.count - 1);
  }
  if (freedom < 1) return;
  axis.noise = std::sqrt(squares / freedom);
  axis.noise_density = std::sqrt(0.5 * differences / pairs) * std::sqrt(2 * period);
  // Two single readings, one before and one after the step.
  axis.resolution = kTwoSided95 * std::numbers::sqrt2 * axis.noise;
}

void measure_drift(const Eigen::VectorXd& time, const Eigen::VectorXd& error,
                   const std::vector<Window>& rests, AxisReport& axis) {
  Eigen::VectorXd times(rests.size());
  Eigen::VectorXd errors(rests.size());
  for (std::size_t i = 0; i < rests.size(); ++i) {
    times[i] = rests[i].of(time).mean();
    errors[i] = rests[i].of(error).mean();
  }
  if (rests.size() >= 3 && times[times.size() - 1] - times[0] >= kDriftSeconds)
    axis.drift_per_hour = 3600 * slope(times, errors);
}

/// Windows that follow each other are one hold.
void measure_creep(const Rows& course, const Series& series, const std::vector<Window>& windows,
                   AxisReport& axis) {
  std::vector<double> creep;
  for (std::size_t i = 0; i < windows.size();) {
    Window hold = windows[i++];
    while (i < windows.size() && windows[i].first == hold.first + hold.count &&
           course.segment[windows[i].first] == course.segment[hold.first])
      hold.count += windows[i++].count;
    const Eigen::VectorXd t = hold.of(course.time);
    const double seconds = t[hold.count - 1] - t[0];
    const double load = hold.of(series.felt).mean();
    if (seconds >= kCreepSeconds && std::abs(load) >= kCreepShare * axis.full_scale)
      creep.push_back(100 * slope(t, hold.of(series.error)) * seconds / load);
  }
  if (creep.size() >= 2) axis.creep_percent = median(creep);
}

/// The combination of the axes that changed which changed least, each in its own standard
/// deviations.
void find_weakest(const Eigen::MatrixXd& felt, const std::vector<Eigen::Index>& axes,
                  Analysis& analysis) {
  if (axes.size() < 2) return;
  Eigen::MatrixXd z = felt(Eigen::all, axes);
  for (auto column : z.colwise())
    column = ((column.array() - column.mean()) / standard_deviation(column)).eval();
  const EigenSystem<Eigen::Dynamic> eigen =
      symmetric_eigen(Eigen::MatrixXd(z.transpose() * z / static_cast<double>(z.rows())));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const double share = eigen.vectors(i, 0);
    if (std::abs(share) < 0.3) continue;
    analysis.weakest += fmt::format("{}{}{}", analysis.weakest.empty() ? "" : " ",
                                    share > 0 ? "+" : "-", kWrenchAxes[axes[i]]);
  }
  analysis.weakest_share = std::sqrt(std::max(0.0, eigen.values[0]));
}

/// Slopes of each axis' error over all loads; NaN where loads went together too much to tell.
void measure_cross_talk(Analysis& analysis, const Eigen::MatrixXd& error) {
  const LinearModel model = fit_linear(analysis.felt, error, 0);
  const Eigen::MatrixXd slopes = model.matrix();
  for (int k = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) {
      const double errs = analysis.axis[k].full_scale;
      const double percent = 100 * analysis.axis[j].full_scale / (errs > 0 ? errs : 1);
      const double sigma = model.scale[j] * std::sqrt(model.inverse(j, j) * model.variance[k]);
      const bool known = errs > 0 && analysis.axis[j].independent >= kMinIndependent &&
                         percent * sigma < kCrossTalkSigma;
      analysis.cross_talk(k, j) = known ? percent * slopes(k, j) : kNaN;
    }
  }
}

/// Why the axis is not calibrated by loads like these; empty: it is.
std::string judge_axis(AxisReport& axis, const char* unit, const Eigen::VectorXd& load,
                       const Eigen::MatrixXd& others) {
  const double deviation = standard_deviation(load);
  if (!(deviation > kUnknownNoise * axis.full_scale) || axis.full_scale == 0)
    return "never loaded: the reference does not change";
  const double wavers = std::max(axis.reference_noise, deviation / kMaxExcitation);
  axis.excitation = deviation / wavers;
  const LinearModel told = fit_linear(others, load, 0);
  axis.independent = standard_deviation(load - told.predict(others).col(0)) / wavers;
  if (axis.excitation < kMinExcitation) {
    return fmt::format(
        "hardly loaded: {:.2g} {} (standard deviation), {:.1f} times the reference's own noise; "
        "{:.0f} are needed",
        deviation, unit, axis.excitation, kMinExcitation);
  }
  if (axis.independent >= kMinIndependent) return {};
  return fmt::format(
      "never loaded by itself: what the other axes do not tell of its load is {:.1f} times the "
      "reference's own noise",
      axis.independent);
}

}  // namespace

Eigen::MatrixXd LinearModel::predict(const Eigen::MatrixXd& features) const {
  return (standardised(*this, features) * weights).rowwise() + offset.transpose();
}

Eigen::MatrixXd LinearModel::sigma(const Eigen::MatrixXd& features) const {
  const Eigen::MatrixXd z = standardised(*this, features);
  const Eigen::ArrayXd leverage =
      1.0 / static_cast<double>(rows) + (z * inverse).cwiseProduct(z).rowwise().sum().array();
  return (1 + leverage).sqrt().matrix() * variance.cwiseSqrt().transpose();
}

LinearModel fit_linear(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values,
                       double ridge) {
  LinearModel model;
  model.rows = features.rows();
  const auto n = static_cast<double>(features.rows());
  model.mean = features.colwise().mean();
  const Eigen::MatrixXd centred = features.rowwise() - model.mean.transpose();
  model.scale = Eigen::VectorXd::Zero(features.cols());
  for (Eigen::Index i = 0; i < features.cols(); ++i) {
    const double deviation = std::sqrt(centred.col(i).squaredNorm() / n);
    const double rounding = 1e-13 * (features.col(i).cwiseAbs().maxCoeff() + 1e-300);
    if (deviation > rounding) model.scale[i] = 1 / deviation;
  }
  const Eigen::MatrixXd z = centred * model.scale.asDiagonal();
  model.offset = values.colwise().mean();
  const Eigen::MatrixXd y = values.rowwise() - model.offset.transpose();

  const EigenSystem<Eigen::Dynamic> eigen = symmetric_eigen(Eigen::MatrixXd(z.transpose() * z / n));
  const Eigen::VectorXd& lambda = eigen.values;
  const double largest = lambda.size() > 0 ? lambda[lambda.size() - 1] : 0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(lambda.size());
  double freedom = 1, smallest = largest;
  for (Eigen::Index i = 0; i < lambda.size(); ++i) {
    if (lambda[i] <= kRankTolerance * largest) continue;
    inverse[i] = 1 / ((lambda[i] + ridge) * n);
    freedom += lambda[i] / (lambda[i] + ridge);
    smallest = std::min(smallest, lambda[i]);
  }
  const auto changing = (model.scale.array() > 0).count();
  const bool full = (inverse.array() > 0).count() == changing;
  model.condition = full && changing > 0 ? std::sqrt(largest / smallest)
                                         : std::numeric_limits<double>::infinity();
  model.inverse = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
  model.weights = model.inverse * (z.transpose() * y);
  model.variance = (y - z * model.weights).colwise().squaredNorm() / std::max(1.0, n - freedom);
  return model;
}

double standard_deviation(const Eigen::VectorXd& values) {
  return std::sqrt((values.array() - values.mean()).square().mean());
}

Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  const Eigen::RowVectorXd mean = truth.colwise().mean();
  const Eigen::RowVectorXd total = (truth.rowwise() - mean).colwise().squaredNorm();
  const Eigen::RowVectorXd left = (predicted - truth).colwise().squaredNorm();
  Eigen::VectorXd r2(truth.cols());
  for (Eigen::Index i = 0; i < r2.size(); ++i) {
    const double rounding = kRounding * truth.col(i).cwiseAbs().maxCoeff();
    const bool changes = total[i] > static_cast<double>(truth.rows()) * rounding * rounding;
    r2[i] = changes ? 1 - left[i] / total[i] : kNaN;
  }
  return r2;
}

Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  return (predicted - truth).colwise().norm() / std::sqrt(static_cast<double>(truth.rows()));
}

void judge_excitation(const Eigen::MatrixXd& felt, const Eigen::VectorXd& noise,
                      Analysis& analysis) {
  std::vector<Eigen::Index> changing;
  for (Eigen::Index k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    axis.range_low = felt.col(k).minCoeff();
    axis.range_high = felt.col(k).maxCoeff();
    axis.full_scale = std::max(std::abs(axis.range_low), std::abs(axis.range_high));
    axis.reference_noise = noise[k];
    std::vector<Eigen::Index> others{0, 1, 2, 3, 4, 5};
    others.erase(others.begin() + k);
    axis.reason = judge_axis(axis, kAxisUnits[k], felt.col(k), felt(Eigen::all, others));
    axis.calibrated = axis.reason.empty();
    if (axis.excitation > 0) changing.push_back(k);
  }
  find_weakest(felt, changing, analysis);
}

void measure_held_out(Analysis& analysis) {
  const Eigen::VectorXd r2 = r_squared(analysis.predicted, analysis.felt);
  const Eigen::VectorXd rmse = rms_error(analysis.predicted, analysis.felt);
  const Eigen::MatrixXd error = analysis.predicted - analysis.felt;
  for (int k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    axis.r2 = r2[k];
    axis.rmse = rmse[k];
    if (axis.full_scale == 0) continue;
    axis.rmse_percent = 100 * axis.rmse / axis.full_scale;
    const Series series{analysis.felt.col(k), error.col(k)};
    axis.nonlinearity_percent = nonlinearity(series, axis);
    axis.hysteresis_percent = hysteresis(series, analysis.segment, axis);
    const auto within =
        error.col(k).array().abs() <= kTwoSided95 * analysis.predicted_sigma.col(k).array();
    axis.coverage = static_cast<double>(within.count()) / static_cast<double>(error.rows());
  }
  measure_cross_talk(analysis, error);
}

void measure_rest(const Rows& all, bool one_clock, Analysis& analysis) {
  const std::vector<Window> quiet = quiet_windows(all, analysis);
  std::vector<Window> rests = quiet;
  std::erase_if(rests, [&](const Window& w) {
    const Eigen::VectorXd load = all.felt.middleRows(w.first, w.count).colwise().mean();
    bool loaded = false;
    for (int k = 0; k < 6; ++k)
      loaded |= std::abs(load[k]) > kRestShare * analysis.axis[k].full_scale;
    return loaded;
  });
  for (int k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    if (axis.full_scale == 0) continue;
    const Series series{all.felt.col(k), all.predicted.col(k) - all.felt.col(k)};
    // At rest where there is enough of it: a weight that hangs still swings a little.
    measure_noise(all.time, all.predicted.col(k), rests.size() >= kMinRests ? rests : quiet,
                  1 / analysis.reading_rate, axis);
    if (one_clock) measure_drift(all.time, series.error, rests, axis);
    measure_creep(all, series, quiet, axis);
  }
}

}  // namespace tagwrench::study
