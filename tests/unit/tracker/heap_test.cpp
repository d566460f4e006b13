// A held target is tracked without the heap. glibc's malloc family is counted, which operator new
// and Eigen go through; this file is left out of sanitizer builds, which bring their own.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "host/tracker/tracker.h"
#include "tests/unit/tracker/render.h"

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace tagwrench {
namespace {

class AllocationCounter {
 public:
  void start() {
    count_ = 0;
    on_ = true;
  }
  long stop() {
    on_ = false;
    return count_;
  }
  void tick() {
    if (on_.load(std::memory_order_relaxed)) ++count_;
  }

 private:
  std::atomic<bool> on_{false};
  std::atomic<long> count_{0};
};

constinit AllocationCounter counter;

}  // namespace
}  // namespace tagwrench

extern "C" {
void* malloc(std::size_t size) {
  tagwrench::counter.tick();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  tagwrench::counter.tick();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  tagwrench::counter.tick();
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  tagwrench::counter.tick();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  tagwrench::counter.tick();
  *block = __libc_memalign(alignment, size);
  return *block != nullptr ? 0 : ENOMEM;
}
}

namespace tagwrench {
namespace {

TEST(TrackerHeap, CounterSeesNewAndMalloc) {
  counter.start();
  auto* number = new int(1);
  void* block = std::malloc(10);
  const long count = counter.stop();
  EXPECT_GE(count, 2);
  delete number;
  std::free(block);
}

TEST(TrackerHeap, HeldTargetAllocatesNothing) {
  const render::Scene scene = render::roof();
  CameraModel camera;
  Tracker tracker(camera, TargetDescription{}, RestOptions{3, {}});
  std::mt19937 random(5);
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  std::vector<render::Picture> pictures;
  for (int i = 0; i < 3; ++i) pictures.push_back(render::develop(scene, light, random));
  for (int i = 0; i < 6; ++i) {
    Vector6 displacement = Vector6::Zero();
    displacement[0] = 5e-5 * i;
    displacement[5] = 5e-3 * i;
    pictures.push_back(render::take(scene, displacement, random));
  }
  Duration spent{};
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    Frame frame;
    frame.image = pictures[i].view();
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40 * i);
    if (i == 4) counter.start();
    const auto before = std::chrono::steady_clock::now();
    const Track track = tracker.track(frame);
    if (i >= 4) spent += std::chrono::steady_clock::now() - before;
    if (i >= 3) {
      EXPECT_EQ(track.status, Status::ok) << i;
    }
  }
  EXPECT_EQ(counter.stop(), 0);
  std::printf("%.0f us a frame\n", static_cast<double>(spent.count()) / 1e3 / 5);
}

}  // namespace
}  // namespace tagwrench
