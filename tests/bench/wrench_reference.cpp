#include "tests/bench/wrench_reference.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "host/source/simulator/trajectory.h"

namespace tagwrench::bench {
namespace {

constexpr double kIdealPeriod = 1e-3;  // s

// OptoForce: counts per N and per N m of one HEX-58-RE-400N, from the paper's script.
const Vector6 kCounts = (Vector6() << 96.11, 95.64, 20.92, 5425.36, 5524.60, 8103.25).finished();
constexpr double kNoise_counts = 1;
constexpr double kCorner_hz = 15;
constexpr double kLag = 0.040;  // s, of filter and transport together at low frequencies
// s. Its crystal is 100 ppm off, so that its readings drift past the frames by one of its periods
// in 100 s, and interpolation between them is the same for no two segments of time.
constexpr double kPeriod = 0.010 * (1 + 1e-4);
constexpr int kSteps = 10;  // of the filter, in a period
// Its surface touches the sensor's base, which is a spring's length and a lens distance below.
const Eigen::Vector3d kOrigin(0, 0, -0.051);

}  // namespace

Vector6 moved_to(const Eigen::Vector3d& origin, const Vector6& wrench) {
  Vector6 moved = wrench;
  moved.tail<3>() -= origin.cross(Eigen::Vector3d(wrench.head<3>()));
  return moved;
}

ReferenceRecord ideal_reference(const sim::Scenario& scenario, double seconds) {
  const sim::TrajectoryPlayer hand(scenario.trajectory, scenario.seed);
  const auto count = static_cast<Eigen::Index>(std::floor(seconds / kIdealPeriod)) + 1;
  ReferenceRecord record;
  record.name = "ideal reference";
  record.time.resize(count);
  record.wrench.resize(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    record.time[i] = kIdealPeriod * static_cast<double>(i);
    record.wrench.row(i) = hand.applied_wrench(record.time[i]).transpose();
  }
  return record;
}

ReferenceRecord optoforce_reference(const sim::Scenario& scenario, double seconds) {
  const sim::TrajectoryPlayer hand(scenario.trajectory, scenario.seed);
  const double filter_time = 1 / (2 * std::numbers::pi * kCorner_hz);
  const double transport = kLag - filter_time;
  const double step = kPeriod / kSteps;
  const double forget = std::exp(-step / filter_time);
  const auto count = static_cast<Eigen::Index>(std::floor(seconds / kPeriod)) + 1;
  std::mt19937_64 random(scenario.seed);
  std::normal_distribution<double> noise(0, kNoise_counts);

  ReferenceRecord record;
  record.name = "OptoForce model";
  record.origin = kOrigin;
  record.time.resize(count);
  record.wrench.resize(count, 6);
  Vector6 filtered = Vector6::Zero();
  Vector6 squares = Vector6::Zero();
  for (Eigen::Index i = 0; i < count; ++i) {
    const double time = kPeriod * static_cast<double>(i);
    for (int back = kSteps - 1; back >= 0; --back) {
      // The middle of the step, or the filter would lag by half a step more than it should.
      const double then = time - step * (back + 0.5) - transport;
      filtered += (1 - forget) * (moved_to(kOrigin, hand.applied_wrench(then)) - filtered);
    }
    record.time[i] = time;
    for (int axis = 0; axis < 6; ++axis) {
      const double counts = std::round(filtered[axis] * kCounts[axis] + noise(random));
      record.wrench(i, axis) = counts / kCounts[axis];
      const double added = record.wrench(i, axis) - filtered[axis];
      squares[axis] += added * added;
    }
  }
  record.noise = (squares / static_cast<double>(count)).cwiseSqrt();
  return record;
}

}  // namespace tagwrench::bench
