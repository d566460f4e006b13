// From frame to text without the heap.
#include "host/output/line_outputs.h"
#include "tests/sim/played.h"
#include "tests/support/heap_count.h"

namespace tagwrench::test {
namespace {

TEST(HeapCount, SeesNewAndMalloc) {
  start_counting_allocations();
  int* volatile number = new int(1);  // volatile: the compiler may leave out what nobody looks at
  void* volatile block = std::malloc(10);
  const long count = stop_counting_allocations();
  delete number;
  std::free(block);
  EXPECT_EQ(count, 2);
}

TEST_F(PipelineLoop, SteadyStateNeedsNoHeapFromFrameToText) {
  outputs_.push_back(std::make_unique<JsonlOutput>("/dev/null", true));
  outputs_.push_back(std::make_unique<CsvOutput>("/dev/null", true));
  long allocations = -1;
  auto counter = std::make_unique<Recorder>([&allocations](const Sample& sample) {
    if (sample.sequence == 20) start_counting_allocations();
    if (sample.sequence == 220) allocations = stop_counting_allocations();
    return SendStatus::ok;
  });
  PlayedSource source(230, PlayedSource::After::end);
  run(source, std::move(counter));
  EXPECT_EQ(recorder().samples.back().status, Status::ok);
  EXPECT_EQ(allocations, 0) << "in 200 frames";
}
}  // namespace
}  // namespace tagwrench::test
