#include "tests/bench/tracker_scores.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tests/support/after_fit.h"

namespace tagwrench::bench {
namespace {

Vector6 root_mean(const Vector6& sum_of_squares, std::size_t count) {
  if (count == 0) return Vector6::Constant(std::numeric_limits<double>::quiet_NaN());
  return (sum_of_squares / static_cast<double>(count)).cwiseSqrt();
}

}  // namespace

bool is_wrong(const Vector6& error) {
  return error.head<2>().cwiseAbs().maxCoeff() > 50e-6 || std::abs(error[2]) > 150e-6 ||
         error.tail<3>().cwiseAbs().maxCoeff() > 10e-3;
}

MotionScore score_motion(const std::vector<Record>& records) {
  MotionScore score;
  std::vector<Vector6> readings, truths;
  std::vector<double> times;
  Vector6 sum = Vector6::Zero();
  double nees = 0;
  bool before_ok = false;
  for (const Record& r : records) {
    if (r.phase == Phase::moving) {
      ++score.frames;
      if (!r.reading.ok) ++score.lost;
      if (r.reading.ok) {
        const Vector6 error = r.reading.displacement - r.truth;
        readings.push_back(r.reading.displacement);
        truths.push_back(r.truth);
        sum += error.cwiseAbs2();
        if (is_wrong(error)) ++score.wrong;
        if (before_ok) times.push_back(r.us);
        if (r.reading.covariance.trace() > 0)
          nees += error.dot(r.reading.covariance.ldlt().solve(error));
      }
    }
    before_ok = r.reading.ok;
  }
  score.raw = root_mean(sum, readings.size());
  score.after_fit = test::error_after_fit(readings, truths);
  if (!readings.empty()) score.nees = nees / static_cast<double>(readings.size());
  std::sort(times.begin(), times.end());
  if (!times.empty()) {
    score.median_us = times[times.size() / 2];
    score.p99_us = times[times.size() * 99 / 100];
  }
  return score;
}

Vector6 std_at_fixed_poses(const std::vector<Record>& records) {
  struct Sums {
    int frames = 0, ok = 0;
    Vector6 first = Vector6::Zero(), squares = Vector6::Zero();
  };
  std::map<int, Sums> poses;
  for (const Record& r : records) {
    if (r.phase != Phase::held) continue;
    Sums& sums = poses[r.pose];
    ++sums.frames;
    if (!r.reading.ok) continue;
    ++sums.ok;
    const Vector6 error = r.reading.displacement - r.truth;
    sums.first += error;
    sums.squares += error.cwiseAbs2();
  }
  Vector6 variance = Vector6::Zero();
  std::size_t count = 0;
  for (const auto& [pose, s] : poses) {
    if (s.ok < 2 || 2 * s.ok < s.frames) return root_mean(variance, 0);
    variance += (s.squares - s.first.cwiseAbs2() / s.ok) / (s.ok - 1);
    ++count;
  }
  return root_mean(variance, count);
}

double first_frame_us(const std::vector<Record>& records) {
  return records.empty() ? 0 : records.front().us;
}

}  // namespace tagwrench::bench
