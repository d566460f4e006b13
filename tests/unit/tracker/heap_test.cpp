// A held target is tracked without the heap.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "host/tracker/tracker.h"
#include "tests/support/heap_count.h"
#include "tests/unit/tracker/render.h"

namespace tagwrench {
namespace {

TEST(TrackerHeap, HeldTargetAllocatesNothing) {
  const render::Scene scene = render::roof();
  CameraModel camera;
  Tracker tracker(camera, TargetDescription{}, ReferenceOptions{3, {}, {}});
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
    if (i == 4) test::start_counting_allocations();
    const auto before = std::chrono::steady_clock::now();
    const Track track = tracker.track(frame);
    if (i >= 4) spent += std::chrono::steady_clock::now() - before;
    if (i >= 3) {
      EXPECT_EQ(track.status, Status::ok) << i;
      EXPECT_FALSE(track.wanted.empty()) << "by its picture, not by its edges";
    }
  }
  EXPECT_EQ(test::stop_counting_allocations(), 0);
  std::printf("%.0f us a frame\n", static_cast<double>(spent.count()) / 1e3 / 5);
}

}  // namespace
}  // namespace tagwrench
