// The simulated reference instruments: their times, lags, noise, steps, and what can be wrong.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/source/simulator/bench.h"
#include "tests/unit/source/simulator/bench_rig.h"

namespace tagwrench::sim {
namespace {

const Eigen::Vector3d kPoint{10e-3, -3e-3, 6e-3};

/// Everything that the instrument says over `seconds`, taken as frames would take it.
template <class Instrument>
std::vector<SimulatedReading> listen(BenchRig& rig, Instrument& instrument, double seconds) {
  std::vector<SimulatedReading> readings;
  for (const double end = rig.time + seconds; rig.time < end;) {
    rig.run(0.04);
    for (SimulatedReading reading; instrument.next(reading);) readings.push_back(reading);
  }
  return readings;
}

double standard_deviation(const std::vector<SimulatedReading>& readings, std::size_t axis) {
  double sum = 0, squares = 0;
  for (const SimulatedReading& reading : readings) {
    sum += reading.value[axis];
    squares += reading.value[axis] * reading.value[axis];
  }
  const auto n = static_cast<double>(readings.size());
  return std::sqrt((squares - sum * sum / n) / (n - 1));
}

TEST(SimulatedLoadCell, SpeaksEightyTimesASecondWithTheNoiseAndStepsOfAnHx711) {
  BenchRig rig({});
  SimulatedLoadCell cell(rig.bench);
  const auto readings = listen(rig, cell, 20);
  ASSERT_NEAR(static_cast<double>(readings.size()), 80 * rig.time, 1);
  for (std::size_t i = 1; i < readings.size(); ++i) {
    EXPECT_NEAR(readings[i].time - readings[i - 1].time, 1.0 / 80, 1e-9);
  }
  const LoadCellSettings settings;
  EXPECT_NEAR(standard_deviation(readings, 0), settings.noise, 0.08 * settings.noise);
  for (const SimulatedReading& reading : readings) {
    const double counts = reading.value[0] * settings.counts_per_newton;
    EXPECT_NEAR(counts, std::round(counts), 1e-6);
    EXPECT_EQ(reading.axes, 1);
    EXPECT_NEAR(reading.sigma[0], settings.noise, 0.01 * settings.noise);
    EXPECT_FALSE(reading.saturated);
  }
}

TEST(SimulatedLoadCell, FeelsThePushItsLagAgo) {
  BenchSettings settings;
  settings.load_cell.lag = 0.025;
  settings.load_cell.noise = 0;
  BenchRig rig(settings);
  SimulatedLoadCell cell(rig.bench);
  rig.bench.push(kPoint, Eigen::Vector3d::UnitX(), 0.6, 4, 2);
  const auto readings = listen(rig, cell, 5);
  double most = 0, scale = 0, weight = 0;
  for (const SimulatedReading& reading : readings) {
    const double force = rig.bench.cell_force(reading.time - 0.025);
    scale += force * reading.value[0];
    weight += force * force;
    most = std::max(most, force);
  }
  scale /= weight;
  EXPECT_GT(most, 0.3);
  EXPECT_NE(scale, 1) << "its own calibration has an error";
  EXPECT_NEAR(scale, 1, 3 * settings.load_cell.scale_error);
  for (const SimulatedReading& reading : readings) {
    const double force = rig.bench.cell_force(reading.time - 0.025);
    EXPECT_NEAR(reading.value[0], scale * force, 1 / settings.load_cell.counts_per_newton);
  }
}

TEST(SimulatedLoadCell, AnIdealOneIsTheTruth) {
  BenchRig rig(perfect());
  SimulatedLoadCell cell(rig.bench);
  rig.bench.push(kPoint, Eigen::Vector3d::UnitX(), 0.6, 4, 2);
  for (const SimulatedReading& reading : listen(rig, cell, 5)) {
    EXPECT_EQ(reading.value[0], rig.bench.cell_force(reading.time));
  }
}

TEST(SimulatedLoadCell, SaturatesAndSaysSo) {
  BenchSettings settings;
  settings.load_cell.range = 0.3;
  BenchRig rig(settings);
  SimulatedLoadCell cell(rig.bench);
  rig.bench.push(kPoint, Eigen::Vector3d::UnitX(), 0.6, 4, 2);
  int saturated = 0;
  for (const SimulatedReading& reading : listen(rig, cell, 5)) {
    const double force = rig.bench.cell_force(reading.time - settings.load_cell.lag);
    EXPECT_EQ(reading.saturated, force > 0.3);
    EXPECT_LT(reading.value[0], 0.31);
    saturated += reading.saturated ? 1 : 0;
  }
  EXPECT_GT(saturated, 20);
}

TEST(ReferenceFaults, WrongSignSilenceAndAnotherClock) {
  BenchSettings settings = perfect();
  ReferenceFaults& faults = settings.load_cell.faults;
  faults.wrong_sign = true;
  faults.silent_from = 2;
  faults.silent_to = 3;
  faults.clock_offset = 7;
  faults.clock_ppm = 1000;
  settings.six_axis.faults = faults;
  BenchRig rig(settings);
  SimulatedLoadCell cell(rig.bench);
  SimulatedSixAxis six(rig.bench);
  rig.bench.push(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 0.6, 4, 1);
  std::vector<SimulatedReading> of_cell, of_six;
  while (rig.time < 5) {
    rig.run(0.04);
    for (SimulatedReading r; cell.next(r);) of_cell.push_back(r);
    for (SimulatedReading r; six.next(r);) of_six.push_back(r);
  }
  for (const auto* readings : {&of_cell, &of_six}) {
    double least = 0;
    for (const SimulatedReading& reading : *readings) {
      const double truly = (reading.time - 7) / (1 + 1000e-6);
      EXPECT_FALSE(truly >= 2 && truly < 3) << truly;
      EXPECT_NEAR(reading.value[0], -rig.bench.cell_force(truly), 1e-6);
      least = std::min(least, reading.value[0]);
    }
    EXPECT_LT(least, -0.4);
  }
  EXPECT_NEAR(static_cast<double>(of_cell.size()), 80 * (rig.time - 1), 1);
  EXPECT_NEAR(static_cast<double>(of_six.size()), 100 * (rig.time - 1), 1);
}

TEST(SimulatedSixAxis, HasOptoForcesRateCountsAndNoise) {
  BenchRig rig({});
  SimulatedSixAxis six(rig.bench);
  const auto readings = listen(rig, six, 20);
  ASSERT_NEAR(static_cast<double>(readings.size()), 100 * rig.time, 1);
  const SixAxisSettings settings;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    // One count of noise, and a twelfth more variance by the rounding.
    const double expected = std::sqrt(1 + 1.0 / 12) / settings.counts_per_unit[axis];
    EXPECT_NEAR(standard_deviation(readings, axis), expected, 0.08 * expected) << axis;
    EXPECT_NEAR(readings.front().sigma[axis], expected, 1e-9);
  }
  EXPECT_NEAR(1 / settings.counts_per_unit[2], 0.048, 1e-3) << "N, the step of Fz";
  for (std::size_t i = 1; i < readings.size(); ++i) {
    EXPECT_NEAR(readings[i].time - readings[i - 1].time, 0.01, 1e-9);
    const double counts = readings[i].value[4] * settings.counts_per_unit[4];
    EXPECT_NEAR(counts, std::round(counts), 1e-6);
  }
}

TEST(SimulatedSixAxis, FeelsTheLoadAboutItsOwnOrigin) {
  BenchRig rig(perfect());
  SimulatedSixAxis six(rig.bench);
  rig.bench.turn({0.8, 0, -0.6});
  rig.bench.hang(0.05, kPoint);
  rig.finish();
  rig.run(1);
  const auto readings = listen(rig, six, 0.5);
  const Vector6 truth = rig.wrench();
  const Eigen::Vector3d force = truth.head<3>(), torque = truth.tail<3>();
  const Eigen::Vector3d origin = rig.bench.settings().six_axis.origin;
  const SimulatedReading& last = readings.back();
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    EXPECT_NEAR(last.value[axis], force[i], 1e-6);
    EXPECT_NEAR(last.value[axis + 3] + origin.cross(force)[i], torque[i], 1e-8);
  }
  EXPECT_GT(std::abs(last.value[4] - torque[1]), 0.01) << "N m; 51 mm below, 0.4 N are felt";
}

TEST(SimulatedSixAxis, AnswersLateByItsLagAndRoundsOffByItsFilter) {
  BenchSettings settings = perfect();
  settings.perfect = false;
  settings.errors = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  settings.six_axis.place_error = settings.six_axis.turn_error = 0;
  settings.times.swing_rad = 0;
  settings.times.load = 0.01;  // a step, to an instrument of 15 Hz
  settings.six_axis.noise_counts = 0;
  settings.six_axis.counts_per_unit.fill(1e6 / 40);
  settings.six_axis.rate = 1000;
  BenchRig rig(settings);
  SimulatedSixAxis six(rig.bench);
  rig.bench.hang(0.05, Eigen::Vector3d::Zero());
  const auto readings = listen(rig, six, 1.5);
  const double final = -0.05 * settings.gravity;
  const double middle = settings.times.reaction + 0.005;
  // A step's mean delay is the area over its answer; at one time constant after the pure delay
  // 63 % are there.
  double area = 0;
  for (const SimulatedReading& reading : readings) {
    if (reading.time > middle) area += (1 - reading.value[2] / final) * 1e-3;
  }
  EXPECT_NEAR(area, settings.six_axis.lag, 1.0e-3) << "s";
  const double tau = 1 / (2 * std::numbers::pi * settings.six_axis.filter_hz);
  for (const SimulatedReading& reading : readings) {
    const double since = reading.time - middle - (settings.six_axis.lag - tau);
    if (since > 0.01) {
      EXPECT_NEAR(reading.value[2] / final, 1 - std::exp(-since / tau), 0.01) << since;
    }
    if (since < -0.006) {
      EXPECT_EQ(reading.value[2], 0) << since;
    }
  }
}

TEST(SimulatedSixAxis, SaturatesAxisByAxis) {
  BenchSettings settings = perfect();
  settings.perfect = false;
  settings.times.swing_rad = 0;
  settings.six_axis.range[2] = 0.3;
  BenchRig rig(settings);
  SimulatedSixAxis six(rig.bench);
  rig.bench.hang(0.05, Eigen::Vector3d::Zero());
  const auto readings = listen(rig, six, 3);
  EXPECT_FALSE(readings.front().saturated);
  EXPECT_TRUE(readings.back().saturated);
  EXPECT_NEAR(readings.back().value[2], -0.3, 0.2);
}

TEST(SimulatedSixAxis, WhatNobodyTookIsLostAndTheRestIsRight) {
  BenchRig rig(perfect());
  SimulatedSixAxis six(rig.bench);
  rig.bench.push(kPoint, Eigen::Vector3d::UnitY(), 0.5, 8, 4);
  rig.run(6);
  int count = 0;
  for (SimulatedReading reading; six.next(reading); ++count) {
    EXPECT_NEAR(reading.value[1], rig.bench.cell_force(reading.time), 1e-5);
  }
  EXPECT_NEAR(count, 200, 3) << "two seconds";
}

}  // namespace
}  // namespace tagwrench::sim
