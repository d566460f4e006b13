#include "host/calibration/analysis/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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

Eigen::MatrixXd LinearModel::matrix() const { return weights.transpose() * scale.asDiagonal(); }

Eigen::VectorXd LinearModel::constant() const { return offset - matrix() * mean; }

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
  double freedom = 1;
  double smallest = largest;
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

Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  const Eigen::RowVectorXd mean = truth.colwise().mean();
  const Eigen::RowVectorXd total = (truth.rowwise() - mean).colwise().squaredNorm();
  const Eigen::RowVectorXd left = (predicted - truth).colwise().squaredNorm();
  Eigen::VectorXd r2(truth.cols());
  for (Eigen::Index i = 0; i < r2.size(); ++i) {
    const double rounding = kRounding * truth.col(i).cwiseAbs().maxCoeff();
    const bool changes = total[i] > static_cast<double>(truth.rows()) * rounding * rounding;
    r2[i] = changes ? 1 - left[i] / total[i] : std::numeric_limits<double>::quiet_NaN();
  }
  return r2;
}

Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  return (predicted - truth).colwise().norm() / std::sqrt(static_cast<double>(truth.rows()));
}

namespace {

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

double standard_deviation(const Eigen::VectorXd& v) {
  return std::sqrt((v.array() - v.mean()).square().mean());
}

/// Slope of v over t, per second.
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
  double most = std::numeric_limits<double>::quiet_NaN();
  for (const double value : values) {
    if (std::isfinite(value) && !(std::abs(value) <= most)) most = std::abs(value);
  }
  return most;
}

/// Means of the error in bins of the load; NaN where there are too few.
Eigen::VectorXd binned(const Series& s, const std::vector<Eigen::Index>& rows, double low,
                       double high) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kBins);
  Eigen::VectorXi count = Eigen::VectorXi::Zero(kBins);
  for (const Eigen::Index i : rows) {
    const auto bin = std::clamp(static_cast<Eigen::Index>((s.felt[i] - low) / (high - low) * kBins),
                                Eigen::Index{0}, Eigen::Index{kBins - 1});
    sum[bin] += s.error[i];
    ++count[bin];
  }
  const int least = s.felt.size() < kFewRows ? 1 : kMinInBin;
  for (Eigen::Index b = 0; b < kBins; ++b)
    sum[b] = count[b] >= least ? sum[b] / count[b] : std::numeric_limits<double>::quiet_NaN();
  return sum;
}

double nonlinearity(const Series& s, double low, double high, double full_scale) {
  if (!(high > low)) return 0;
  std::vector<Eigen::Index> all(static_cast<std::size_t>(s.felt.size()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Eigen::Index>(i);
  const double gain = slope(s.felt, s.error);
  Series about_line = s;
  about_line.error.array() -= s.error.mean() + gain * (s.felt.array() - s.felt.mean());
  return 100 * largest(binned(about_line, all, low, high)) / full_scale;
}

double hysteresis(const Series& s, const Eigen::VectorXi& segment, double low, double high,
                  double noise, double full_scale) {
  if (!(high > low)) return 0;
  std::vector<Eigen::Index> rising;
  std::vector<Eigen::Index> falling;
  for (Eigen::Index i = 1; i + 1 < s.felt.size(); ++i) {
    if (segment[i - 1] != segment[i + 1]) continue;
    const double change = s.felt[i + 1] - s.felt[i - 1];
    if (std::abs(change) <= 3 * noise) continue;
    (change > 0 ? rising : falling).push_back(i);
  }
  const Eigen::VectorXd gap = binned(s, rising, low, high) - binned(s, falling, low, high);
  return 100 * largest(gap) / full_scale;
}

/// Rows of a course in which the load stands still.
struct Window {
  Eigen::Index first = 0;
  Eigen::Index count = 0;
};

std::vector<Window> quiet_windows(const Course& course, const Analysis& analysis, double period) {
  const auto rows =
      std::max(kMinQuietRows, static_cast<Eigen::Index>(std::lround(kQuietSeconds / period)));
  std::vector<Window> windows;
  for (Eigen::Index first = 0; first + rows <= course.time.size();) {
    bool quiet = course.segment[first] == course.segment[first + rows - 1];
    for (std::size_t k = 0; k < 6 && quiet; ++k) {
      const AxisReport& axis = analysis.axis[k];
      const Eigen::VectorXd load =
          course.felt.col(static_cast<Eigen::Index>(k)).segment(first, rows);
      quiet = load.maxCoeff() - load.minCoeff() <=
              std::max(6 * axis.reference_noise, kQuietShare * axis.full_scale);
    }
    if (quiet) windows.push_back({first, rows});
    first += quiet ? rows : std::max<Eigen::Index>(1, rows / 4);
  }
  return windows;
}

bool at_rest(const Course& course, const Analysis& analysis, const Window& w) {
  for (Eigen::Index j = 0; j < 6; ++j) {
    const double load = course.felt.col(j).segment(w.first, w.count).mean();
    if (std::abs(load) > kRestShare * analysis.axis[static_cast<std::size_t>(j)].full_scale)
      return false;
  }
  return true;
}

/// Those at rest, where there are enough of them: a weight that hangs still swings a little.
std::vector<Window> noise_windows(const Course& course, const Analysis& analysis,
                                  const std::vector<Window>& windows) {
  std::vector<Window> rests;
  for (const Window& w : windows) {
    if (at_rest(course, analysis, w)) rests.push_back(w);
  }
  return rests.size() >= kMinRests ? rests : windows;
}

/// White noise from neighbours' differences, which drift does not reach: density per root Hz is
/// sqrt(2 period) times the Allan deviation at one period (IEEE Std 952, annex C).
void measure_noise(const Course& course, const std::vector<Window>& windows, Eigen::Index k,
                   double period, AxisReport& axis) {
  double squares = 0;
  double freedom = 0;
  double differences = 0;
  double pairs = 0;
  for (const Window& w : windows) {
    const Eigen::VectorXd t = course.time.segment(w.first, w.count);
    const Eigen::VectorXd p = course.predicted.col(k).segment(w.first, w.count);
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
  axis.resolution = kTwoSided95 * std::numbers::sqrt2 * *axis.noise;
}

void measure_drift(const Course& course, const Analysis& analysis,
                   const std::vector<Window>& windows, Eigen::Index k, AxisReport& axis) {
  std::vector<double> times;
  std::vector<double> errors;
  for (const Window& w : windows) {
    if (!at_rest(course, analysis, w)) continue;
    times.push_back(course.time.segment(w.first, w.count).mean());
    errors.push_back((course.predicted - course.felt).col(k).segment(w.first, w.count).mean());
  }
  if (times.size() < 3 || times.back() - times.front() < kDriftSeconds) return;
  const auto n = static_cast<Eigen::Index>(times.size());
  axis.drift_per_hour = 3600 * slope(Eigen::Map<const Eigen::VectorXd>(times.data(), n),
                                     Eigen::Map<const Eigen::VectorXd>(errors.data(), n));
}

void measure_creep(const Course& course, const std::vector<Window>& windows, Eigen::Index k,
                   AxisReport& axis) {
  std::vector<double> creep;
  for (std::size_t i = 0; i < windows.size();) {
    Window hold = windows[i++];
    while (i < windows.size() && windows[i].first == hold.first + hold.count &&
           course.segment[windows[i].first] == course.segment[hold.first])
      hold.count += windows[i++].count;
    const Eigen::VectorXd t = course.time.segment(hold.first, hold.count);
    const double seconds = t[hold.count - 1] - t[0];
    const double load = course.felt.col(k).segment(hold.first, hold.count).mean();
    if (seconds < kCreepSeconds || std::abs(load) < kCreepShare * axis.full_scale) continue;
    const Eigen::VectorXd error =
        (course.predicted - course.felt).col(k).segment(hold.first, hold.count);
    creep.push_back(100 * slope(t, error) * seconds / load);
  }
  if (creep.size() >= 2) axis.creep_percent = median(creep);
}

std::string combination(const Eigen::VectorXd& direction, const std::vector<std::size_t>& axes) {
  std::vector<std::string> parts;
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    if (std::abs(direction[i]) < 0.3) continue;
    parts.push_back(fmt::format("{}{}", direction[i] > 0 ? "+" : "-",
                                kWrenchAxes[axes[static_cast<std::size_t>(i)]]));
  }
  return fmt::format("{}", fmt::join(parts, " "));
}

/// The combination of the axes that changed which changed least, each in its own standard
/// deviations.
void find_weakest(const Eigen::MatrixXd& felt, const std::vector<std::size_t>& axes,
                  Analysis& analysis) {
  if (axes.size() < 2) return;
  Eigen::MatrixXd z(felt.rows(), static_cast<Eigen::Index>(axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Eigen::VectorXd column = felt.col(static_cast<Eigen::Index>(axes[i]));
    z.col(static_cast<Eigen::Index>(i)) =
        (column.array() - column.mean()) / standard_deviation(column);
  }
  const EigenSystem<Eigen::Dynamic> eigen =
      symmetric_eigen(Eigen::MatrixXd(z.transpose() * z / static_cast<double>(z.rows())));
  analysis.weakest = combination(eigen.vectors.col(0), axes);
  analysis.weakest_share = std::sqrt(std::max(0.0, eigen.values[0]));
}

/// Slopes of each axis' error over all loads; NaN where loads went together too much to tell.
void measure_cross_talk(Analysis& analysis, const Eigen::MatrixXd& error) {
  const LinearModel model = fit_linear(analysis.felt, error, 0);
  const Eigen::MatrixXd slopes = model.matrix();
  for (Eigen::Index k = 0; k < 6; ++k) {
    for (Eigen::Index j = 0; j < 6; ++j) {
      const double errs = analysis.axis[static_cast<std::size_t>(k)].full_scale;
      const double loads = analysis.axis[static_cast<std::size_t>(j)].full_scale;
      const double percent = 100 * loads / (errs > 0 ? errs : 1);
      const double sigma = model.scale[j] * std::sqrt(model.inverse(j, j) * model.variance[k]);
      const bool told = analysis.axis[static_cast<std::size_t>(j)].independent >= kMinIndependent;
      const bool known = errs > 0 && told && percent * sigma < kCrossTalkSigma;
      analysis.cross_talk(k, j) =
          known ? percent * slopes(k, j) : std::numeric_limits<double>::quiet_NaN();
    }
  }
}

}  // namespace

void judge_excitation(const Eigen::MatrixXd& felt, const Eigen::VectorXd& noise,
                      Analysis& analysis) {
  std::vector<std::size_t> changing;
  for (std::size_t k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    const auto at = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd load = felt.col(at);
    axis.range_low = load.minCoeff();
    axis.range_high = load.maxCoeff();
    axis.full_scale = std::max(std::abs(axis.range_low), std::abs(axis.range_high));
    axis.reference_noise = noise[at];
    const double deviation = standard_deviation(load);
    if (!(deviation > kUnknownNoise * axis.full_scale) || axis.full_scale == 0) {
      axis.calibrated = false;
      axis.reason = "never loaded: the reference does not change";
      continue;
    }
    changing.push_back(k);
    const double wavers = std::max(noise[at], deviation / kMaxExcitation);
    axis.excitation = deviation / wavers;
    std::vector<Eigen::Index> others;
    for (Eigen::Index j = 0; j < 6; ++j) {
      if (j != at) others.push_back(j);
    }
    const LinearModel told = fit_linear(felt(Eigen::all, others), load, 0);
    axis.independent =
        standard_deviation(load - told.predict(felt(Eigen::all, others)).col(0)) / wavers;
    if (axis.excitation < kMinExcitation) {
      axis.calibrated = false;
      axis.reason = fmt::format(
          "hardly loaded: {:.2g} {} (standard deviation), {:.1f} times the reference's own noise; "
          "{:.0f} are needed",
          deviation, kAxisUnits[k], axis.excitation, kMinExcitation);
    } else if (axis.independent < kMinIndependent) {
      axis.calibrated = false;
      axis.reason = fmt::format(
          "never loaded by itself: what the other axes do not tell of its load is {:.1f} times the "
          "reference's own noise",
          axis.independent);
    }
  }
  find_weakest(felt, changing, analysis);
}

void measure_held_out(Analysis& analysis) {
  const Eigen::Index n = analysis.time.size();
  const Eigen::VectorXd r2 = r_squared(analysis.predicted, analysis.felt);
  const Eigen::VectorXd rmse = rms_error(analysis.predicted, analysis.felt);
  const Eigen::MatrixXd error = analysis.predicted - analysis.felt;
  for (std::size_t k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    const auto at = static_cast<Eigen::Index>(k);
    axis.r2 = r2[at];
    axis.rmse = rmse[at];
    if (axis.full_scale == 0) continue;
    axis.rmse_percent = 100 * axis.rmse / axis.full_scale;
    const Series series{analysis.felt.col(at), error.col(at)};
    axis.nonlinearity_percent =
        nonlinearity(series, axis.range_low, axis.range_high, axis.full_scale);
    axis.hysteresis_percent = hysteresis(series, analysis.segment, axis.range_low, axis.range_high,
                                         axis.reference_noise, axis.full_scale);
    const auto within =
        (error.col(at).array().abs() <= kTwoSided95 * analysis.predicted_sigma.col(at).array())
            .count();
    axis.coverage = static_cast<double>(within) / static_cast<double>(n);
  }
  measure_cross_talk(analysis, error);
}

void measure_rest(const Course& course, double period, bool one_clock, Analysis& analysis) {
  const std::vector<Window> windows = quiet_windows(course, analysis, period);
  const std::vector<Window> still = noise_windows(course, analysis, windows);
  for (std::size_t k = 0; k < 6; ++k) {
    AxisReport& axis = analysis.axis[k];
    const auto at = static_cast<Eigen::Index>(k);
    if (axis.full_scale == 0) continue;
    measure_noise(course, still, at, period, axis);
    if (one_clock) measure_drift(course, analysis, windows, at, axis);
    measure_creep(course, windows, at, axis);
  }
}

}  // namespace tagwrench::study
