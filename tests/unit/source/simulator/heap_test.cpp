#include <gtest/gtest.h>

#include <bit>

#include "host/source/simulator/bench.h"
#include "host/source/simulator/simulator_source.h"
#include "tests/support/heap_count.h"

namespace tagwrench {
namespace {

TEST(SimulatorSource, NoHeapPerFrame) {
  for (const double readout : {0.0, 10e-3}) {
    sim::Scenario s;
    s.trajectory.rest_time = 0;
    s.exposure.rolling_readout = readout;
    SimulatorSource source(s, false);
    Frame frame;
    source.read(frame);
    test::start_counting_allocations();
    for (int i = 0; i < 30; ++i) source.read(frame);
    EXPECT_EQ(test::stop_counting_allocations(), 0);
  }
}

TEST(SimulatorSource, NoHeapPerFrameWhateverGoesWrong) {
  sim::Scenario s;
  s.trajectory.rest_time = 0;
  s.trajectory.motion = sim::Motion::hard;
  s.exposure.even = true;
  s.disturbances.random = {0.0, 0.2};
  s.disturbances.lost_frames = {0.1, 2};
  SimulatorSource source(s, false);
  Frame frame;
  std::uint32_t kinds = 0;
  source.read(frame);
  test::start_counting_allocations();
  for (int i = 0; i < 60; ++i) {
    source.read(frame);
    kinds |= source.truth().disturbances;
  }
  EXPECT_EQ(test::stop_counting_allocations(), 0);
  EXPECT_GE(std::popcount(kinds), 6);
}

TEST(SimulatorSource, NoHeapPerFrameWhileSomeoneWorksAtTheBench) {
  const sim::Scenario s;
  sim::Bench bench(s.bench, s.seed);
  SimulatorSource source(s, false, nullptr, &bench);
  sim::SimulatedLoadCell cell(bench);
  sim::SimulatedSixAxis six(bench);
  Frame frame;
  source.read(frame);
  test::start_counting_allocations();
  int readings = 0;
  for (int i = 0; i < 60; ++i) {
    if (i == 0) bench.hang(0.05, {15e-3, 0, 6e-3});
    if (i == 15) bench.turn(Eigen::Vector3d::UnitX());
    if (i == 30) bench.push({15e-3, 0, 6e-3}, Eigen::Vector3d::UnitY(), 0.5, 0.5);
    if (i == 45) bench.move_about(Vector6::Constant(5e-3), 1);
    source.read(frame);
    for (sim::SimulatedReading reading; cell.next(reading) || six.next(reading);) ++readings;
  }
  EXPECT_EQ(test::stop_counting_allocations(), 0);
  EXPECT_GT(readings, 300);
}

}  // namespace
}  // namespace tagwrench
