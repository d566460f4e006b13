#include "tests/support/desk_readings.h"

#include <Eigen/Dense>
#include <cmath>

#include "host/source/simulator/mechanics.h"

namespace tagwrench::test {
namespace {

constexpr std::uint64_t kNoiseStream = 1001;

/// Position and speed after `h` seconds of x'' + 2 z w x' + w^2 x = f, as rows of (x, x', f).
std::array<double, 6> exact_step(double w, double z, double h) {
  const double damped = w * std::sqrt(1 - z * z);
  const double decay = std::exp(-z * w * h);
  const double c = decay * std::cos(damped * h);
  const double s = decay * std::sin(damped * h) / damped;
  const double xx = c + z * w * s;
  const double vx = -w * w * s;
  return {xx, s, (1 - xx) / (w * w), vx, c - z * w * s, s};
}

}  // namespace

DeskReadings::DeskReadings(const sim::Scenario& scenario, const DeskReadingOptions& options)
    : options_(options),
      mechanics_(scenario.mechanics),
      use_(scenario),
      random_(scenario.seed, kNoiseStream),
      stiffness_(sim::stiffness(scenario.mechanics)) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> solver(stiffness_,
                                                                 sim::inertia(scenario.mechanics));
  modes_ = solver.eigenvectors();
  for (int i = 0; i < 6; ++i) {
    advance_[static_cast<std::size_t>(i)] =
        exact_step(std::sqrt(solver.eigenvalues()[i]), mechanics_.damping_ratio, kStep);
  }
}

Vector6 DeskReadings::load(double time) {
  Vector6 load = use_.wrench(time, displacement_);
  const Eigen::Vector3d inertial = mechanics_.mass * use_.gravity_change(time);
  load.head<3>() += inertial;
  load.tail<3>() += mechanics_.centre_of_mass.cross(inertial);
  return load;
}

void DeskReadings::step() {
  const Vector6 force = modes_.transpose() * load((static_cast<double>(steps_) + 0.5) * kStep);
  for (int i = 0; i < 6; ++i) {
    const auto& a = advance_[static_cast<std::size_t>(i)];
    const double x = position_[i];
    position_[i] = a[0] * x + a[1] * speed_[i] + a[2] * force[i];
    speed_[i] = a[3] * x + a[4] * speed_[i] + a[5] * force[i];
  }
  displacement_ = modes_ * position_;
  crept_ += kStep / mechanics_.creep_time * (mechanics_.creep_share * displacement_ - crept_);
  ++steps_;
}

Sample DeskReadings::next() {
  do {
    ++frame_;
  } while (random_.uniform() < options_.lost_share);
  const double time = static_cast<double>(frame_) / options_.fps;
  Vector6 sum = Vector6::Zero();
  int count = 0;
  while ((static_cast<double>(steps_) + 1) * kStep <= time + 0.5 * options_.exposure) {
    step();
    if (static_cast<double>(steps_) * kStep < time - 0.5 * options_.exposure) continue;
    sum += displacement_;
    ++count;
  }
  Sample sample;
  sample.sequence = frame_;
  sample.capture_time = TimePoint(Duration(std::llround(1e9 * time)));
  sample.status = random_.uniform() < options_.doubtful_share ? Status::doubtful : Status::ok;
  sample.wrench = stiffness_ * (sum / std::max(count, 1) + crept_ + use_.rest_change(time));
  for (int i = 0; i < 6; ++i) sample.wrench[i] += options_.noise[i] * random_.normal();
  sample.wrench_sigma = options_.noise;
  const Vector6 range = Vector6::Map(mechanics_.range.data());
  if (sample.status == Status::ok && (sample.wrench.array().abs() > range.array()).any()) {
    sample.status = Status::saturated;
  }
  if (sample.status == Status::doubtful) sample.wrench.setZero();
  return sample;
}

}  // namespace tagwrench::test
