#include "host/calibration/analysis/lag.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "host/core/robust_statistics.h"

namespace tagwrench::study {
namespace {

constexpr double kCoarse = 0.010;             // s
constexpr double kFine = 0.002;               // s
constexpr int kFineReach = 12;                // steps to each side
constexpr int kParabola = 2;                  // points to each side of the least
constexpr Eigen::Index kBlocks = 12;          // of the jackknife, at least
constexpr Eigen::Index kMaxReadings = 10000;  // of more, every so many: it costs time, and clocks
                                              // are not as good as that
constexpr double kFloor = 1e-12;              // of the share that no model explains
constexpr double kMinExplained = 0.3;         // R^2 of the best axis, or nothing is known
constexpr double kMaxGap = 5;                 // median intervals of the reference
constexpr int kPointsAside = 10;              // of the triangle that smooths
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A segment with the readings that lie within the reference at every lag that is asked for.
struct Prepared {
  Eigen::VectorXd time;
  Eigen::MatrixXd features;  ///< centred
  const Segment* source = nullptr;
  double longest_gap = 0;
};

Prepared prepare(const Segment& segment, double from, double to, Eigen::Index every) {
  Prepared prepared;
  prepared.source = &segment;
  prepared.longest_gap = kMaxGap * median_interval(segment.reference_time);
  std::vector<Eigen::Index> kept;
  const Eigen::Index last = segment.reference_time.size() - 1;
  for (Eigen::Index i = 0; i < segment.time.size() && last > 0; i += every)
    if (segment.time[i] - to >= segment.reference_time[0] &&
        segment.time[i] - from <= segment.reference_time[last])
      kept.push_back(i);
  prepared.time = segment.time(kept);
  prepared.features = segment.features(kept, Eigen::all);
  if (!kept.empty()) {
    const Eigen::RowVectorXd mean = prepared.features.colwise().mean();
    prepared.features.rowwise() -= mean;
  }
  return prepared;
}

/// Sums of one block of readings, of which any number of one model add up to a regression.
struct Sums {
  int model = 0;
  Eigen::MatrixXd xx;  ///< p x p
  Eigen::MatrixXd xy;  ///< p x q
  Eigen::VectorXd yy;  ///< q
  double n = 0;

  void operator+=(const Sums& other) {
    xx += other.xx;
    xy += other.xy;
    yy += other.yy;
    n += other.n;
  }
};

class LagScan {
 public:
  LagScan(std::span<const Segment> segments, const LagSearch& search, double from, double to)
      : ridge_(search.ridge) {
    Eigen::Index all = 0;
    for (const Segment& segment : segments) all += segment.time.size();
    const Eigen::Index every = std::max<Eigen::Index>(1, all / kMaxReadings);
    for (const Segment& segment : segments) {
      prepared_.push_back(prepare(segment, from, to, every));
      rows_ += prepared_.back().time.size();
    }
    block_rows_ = std::max<Eigen::Index>(1, (rows_ + kBlocks - 1) / kBlocks);
  }

  Eigen::Index rows() const { return rows_; }

  /// The sums at one lag, block by block; always the same blocks.
  std::vector<Sums> blocks_at(double lag) const {
    std::vector<Sums> blocks;
    for (const Prepared& p : prepared_) {
      const Eigen::Index n = p.time.size();
      if (n == 0) continue;
      Eigen::MatrixXd y =
          reference_at(p.time, lag, p.source->reference_time, p.source->reference, p.longest_gap);
      Eigen::VectorXd there = Eigen::VectorXd::Ones(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        if (y.row(i).allFinite()) continue;
        there[i] = 0;
        y.row(i).setZero();
      }
      const double count = there.sum();
      if (count < 1) continue;
      const Eigen::RowVectorXd mean = y.colwise().sum() / count;
      y -= there * mean;
      const Eigen::MatrixXd x = there.asDiagonal() * p.features;
      const Eigen::Index parts = std::max<Eigen::Index>(1, (n + block_rows_ / 2) / block_rows_);
      for (Eigen::Index b = 0; b < parts; ++b) {
        const Eigen::Index first = n * b / parts;
        const Eigen::Index size = n * (b + 1) / parts - first;
        const auto xb = x.middleRows(first, size);
        const auto yb = y.middleRows(first, size);
        blocks.push_back({p.source->model, xb.transpose() * xb, xb.transpose() * yb,
                          yb.colwise().squaredNorm().transpose(),
                          there.segment(first, size).sum()});
      }
    }
    return blocks;
  }

  /// Sum of log(unexplained share), weighted by the readings, of all blocks but `without`; infinite
  /// where there is nothing to regress. `explained` becomes the mean and the largest R^2.
  double criterion(const std::vector<Sums>& blocks, std::size_t without,
                   Eigen::Vector2d* explained = nullptr) const {
    std::map<int, Sums> models;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (b == without) continue;
      const auto [at, is_new] = models.try_emplace(blocks[b].model, blocks[b]);
      if (!is_new) at->second += blocks[b];
    }
    double sum = 0, shares = 0, weight = 0, least = 1;
    for (auto& [model, s] : models) {
      const Eigen::Index p = s.xx.rows();
      if (s.n < static_cast<double>(3 * p)) continue;
      Eigen::VectorXd scale = s.xx.diagonal() / s.n;
      for (double& v : scale) v = v > 0 ? 1 / std::sqrt(v) : 0;
      Eigen::MatrixXd normal = scale.asDiagonal() * s.xx * scale.asDiagonal();
      normal.diagonal().array() += (ridge_ + 1e-12) * s.n;
      const Eigen::MatrixXd xy = scale.asDiagonal() * s.xy;
      const Eigen::MatrixXd weights = normal.ldlt().solve(xy);
      for (Eigen::Index k = 0; k < s.yy.size(); ++k) {
        if (!(s.yy[k] > 0)) continue;
        const double share = std::clamp(1 - xy.col(k).dot(weights.col(k)) / s.yy[k], 0.0, 1.0);
        sum += s.n * std::log(share + kFloor);
        shares += s.n * share;
        weight += s.n;
        least = std::min(least, share);
      }
    }
    if (!(weight > 0)) return kInfinity;
    if (explained != nullptr) *explained = {1 - shares / weight, 1 - least};
    return sum / weight;
  }

 private:
  std::vector<Prepared> prepared_;
  double ridge_;
  Eigen::Index rows_ = 0, block_rows_ = 1;
};

/// Readings and reference by one triangle, wide enough that what is left of the reference's noise
/// is nearly the same between its samples as at them: linear interpolation halves white noise
/// midway, which would draw the lag of clocks in step towards there.
Segment smooth_alike(const Segment& segment) {
  constexpr double kSamples = 4;  // of the reference: its noise then varies by 5 %
  Segment smooth = segment;
  const double width =
      std::max(kSamples * median_interval(segment.reference_time), median_interval(segment.time));
  if (!(width > 0)) return smooth;
  smooth.features = smooth_reference(segment.time, segment.features, width);
  smooth.reference = smooth_reference(segment.reference_time, segment.reference, width);
  return smooth;
}

constexpr std::size_t kAllBlocks = std::numeric_limits<std::size_t>::max();

/// Where the parabola through the points about the least one of an even grid is least.
double lowest(const std::vector<double>& values, double first, double step) {
  const int n = values.size();
  const int least = std::min_element(values.begin(), values.end()) - values.begin();
  const int middle =
      std::clamp(least, std::min(kParabola, n / 2), std::max(n - 1 - kParabola, (n - 1) / 2));
  double s2 = 0, s4 = 0, y0 = 0, y1 = 0, y2 = 0;
  int count = 0;
  for (int j = -kParabola; j <= kParabola; ++j) {
    if (middle + j < 0 || middle + j >= n) continue;
    const double v = values[middle + j];
    s2 += j * j;
    s4 += j * j * j * j;
    y0 += v;
    y1 += j * v;
    y2 += j * j * v;
    ++count;
  }
  const double curvature = (count * y2 - s2 * y0) / (count * s4 - s2 * s2);
  const double slope = y1 / s2;
  const double shift = curvature > 0
                           ? std::clamp(-slope / (2 * curvature), -1.0 * kParabola, 1.0 * kParabola)
                           : least - middle;
  return first + (middle + shift) * step;
}

std::vector<double> grid(double from, double to, double step) {
  const int n = std::max(1, static_cast<int>(std::lround((to - from) / step)));
  std::vector<double> lags;
  for (int i = 0; i <= n; ++i) lags.push_back(from + (to - from) * i / n);
  return lags;
}

}  // namespace

Eigen::MatrixXd reference_at(const Eigen::VectorXd& time, double lag,
                             const Eigen::VectorXd& reference_time,
                             const Eigen::MatrixXd& reference, double longest_gap) {
  Eigen::MatrixXd at = Eigen::MatrixXd::Constant(time.size(), reference.cols(),
                                                 std::numeric_limits<double>::quiet_NaN());
  const double* begin = reference_time.data();
  const double* end = begin + reference_time.size();
  for (Eigen::Index i = 0; i < time.size(); ++i) {
    const double t = time[i] - lag;
    const double* after = std::upper_bound(begin, end, t);
    if (after == begin) continue;
    const Eigen::Index before = after - begin - 1;
    if (reference_time[before] == t) {
      at.row(i) = reference.row(before);
      continue;
    }
    if (after == end) continue;
    const double interval = reference_time[before + 1] - reference_time[before];
    if (interval > longest_gap) continue;
    const double share = (t - reference_time[before]) / interval;
    at.row(i) = (1 - share) * reference.row(before) + share * reference.row(before + 1);
  }
  return at;
}

Lag estimate_lag(std::span<const Segment> given, const LagSearch& search) {
  Lag lag;
  if (given.empty()) return lag;
  std::vector<Segment> smoothed;
  if (search.smooth)
    for (const Segment& segment : given) smoothed.push_back(smooth_alike(segment));
  const std::span<const Segment> segments = search.smooth ? smoothed : given;
  const LagScan coarse(segments, search, search.from, search.to);
  if (coarse.rows() < 3 * segments.front().features.cols()) return lag;
  double best = kInfinity;
  for (const double candidate : grid(search.from, search.to, kCoarse)) {
    const double value = coarse.criterion(coarse.blocks_at(candidate), kAllBlocks);
    if (value < best) {
      best = value;
      lag.value = candidate;
    }
  }
  if (!std::isfinite(best)) return lag;
  lag.at_limit = lag.value < search.from + 0.5 * kCoarse || lag.value > search.to - 0.5 * kCoarse;

  const double reach = kFineReach * kFine;
  const LagScan fine(segments, search, lag.value - reach, lag.value + reach);
  const std::vector<double> lags = grid(lag.value - reach, lag.value + reach, kFine);
  std::vector<std::vector<Sums>> at;
  std::size_t count = std::numeric_limits<std::size_t>::max();
  for (const double candidate : lags) {
    at.push_back(fine.blocks_at(candidate));
    count = std::min(count, at.back().size());
  }
  const auto find = [&](std::size_t without) {
    std::vector<double> values;
    for (const std::vector<Sums>& blocks : at) values.push_back(fine.criterion(blocks, without));
    return lowest(values, lags.front(), kFine);
  };
  lag.value = std::clamp(find(kAllBlocks), search.from, search.to);
  Eigen::ArrayXd without(count);
  for (std::size_t b = 0; b < count; ++b) without[b] = find(b);
  const double blocks = static_cast<double>(count);
  lag.sigma = count > 1
                  ? std::sqrt((without - without.mean()).square().sum() * (blocks - 1) / blocks)
                  : reach;
  Eigen::Vector2d explained = Eigen::Vector2d::Zero();
  fine.criterion(fine.blocks_at(lag.value), kAllBlocks, &explained);
  lag.explained = explained[0];
  lag.known = explained[1] >= kMinExplained && lag.sigma < reach;
  if (!lag.known) {
    lag.value = 0;
    lag.at_limit = false;
  }
  return lag;
}

std::string lag_text(const Lag& lag) {
  const bool late = lag.value >= 0;
  return fmt::format("the {} {:.1f} +- {:.1f} ms after the {}",
                     late ? "readings come" : "reference comes", 1e3 * std::abs(lag.value),
                     1e3 * lag.sigma, late ? "reference" : "readings");
}

std::string lag_warning(const Lag& lag, double from, double to) {
  if (!lag.known)
    return "the lag between readings and reference cannot be told: they do not move together";
  if (lag.at_limit) {
    return lag_text(lag) +
           ": the end of what was searched, so the true lag may lie beyond; are both on one clock?";
  }
  const bool early = lag.value + 2 * lag.sigma < from;
  if (!early && lag.value - 2 * lag.sigma <= to) return {};
  return lag_text(lag) +
         fmt::format(
             ", more than {:.0f} ms; are both on one clock, and stamped when they were taken?",
             1e3 * std::abs(early ? from : to));
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
    const Eigen::MatrixXd at = reference_at(time, -offset, time, values, kInfinity);
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
  const Eigen::VectorXd intervals = time.tail(time.size() - 1) - time.head(time.size() - 1);
  return median({intervals.begin(), intervals.end()});
}

}  // namespace tagwrench::study
