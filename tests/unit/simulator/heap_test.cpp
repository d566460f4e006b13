#include <gtest/gtest.h>

#include <bit>

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

}  // namespace
}  // namespace tagwrench
