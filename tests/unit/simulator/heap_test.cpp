#include <gtest/gtest.h>

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

}  // namespace
}  // namespace tagwrench
