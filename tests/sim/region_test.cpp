// Frames of which only the part around the target is decoded: the run is the same to the last bit,
// and a target that has left this part is found in the same frame.
#include <algorithm>
#include <cmath>

#include "host/source/simulator/renderer.h"
#include "tests/sim/played.h"
#include "tests/support/poisoned_source.h"

namespace tagwrench::test {
namespace {

constexpr int kWidth = 640, kHeight = 480;

using Picture = std::vector<std::uint8_t>;

constexpr double kJump = 1.3e-3;  // m, 48 px: beyond the margin of the region

/// From rest, pushed about in all six axes, a little further with every frame.
Vector6 pushed(int frame) {
  const double t = 0.1 * std::max(0, frame - kRestFrames);
  Vector6 displacement;
  displacement << 0.3e-3 * std::sin(t), 0.2e-3 * std::sin(1.3 * t), 0.3e-3 * std::sin(0.7 * t),
      0.03 * std::sin(0.9 * t), 0.02 * std::sin(1.1 * t), 0.03 * std::sin(1.7 * t);
  return displacement;
}

/// The platform at rest, then pushed about; in frames jump_begin to jump_end - 1 it is elsewhere.
std::vector<Picture> pushed_about(int frames, int jump_begin = 0, int jump_end = 0) {
  const sim::Scenario scenario;
  const sim::TrajectoryPlayer player(scenario.trajectory, scenario.seed);
  sim::Renderer renderer(scenario);
  sim::PlatformMotion motion(scenario.mechanics, player, 0, 2 * renderer.half_window() + 0.01);
  std::vector<Picture> pictures;
  for (int i = 0; i < frames; ++i) {
    Vector6 displacement = pushed(i);
    if (i >= jump_begin && i < jump_end) displacement[0] += kJump;
    motion.set_state({displacement, Vector6::Zero()});
    pictures.emplace_back(kWidth * kHeight);
    renderer.render(motion, 0, static_cast<std::uint64_t>(i), pictures.back().data());
  }
  return pictures;
}

class Pictures final : public FrameSource {
 public:
  explicit Pictures(const std::vector<Picture>& pictures) : pictures_(pictures) {
    format_ = {kWidth, kHeight, std::chrono::milliseconds(40), "pictures"};
  }
  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return -1; }
  ReadStatus read(Frame& frame) noexcept override {
    if (next_ == pictures_.size()) return ReadStatus::end;
    frame = {};
    frame.image = {pictures_[next_].data(), kWidth, kHeight, kWidth};
    frame.capture_time = TimePoint{} + static_cast<int>(next_) * format_.period;
    frame.latency_origin = std::chrono::steady_clock::now();
    frame.sequence = next_++;
    return ReadStatus::frame;
  }

 private:
  const std::vector<Picture>& pictures_;
  SourceFormat format_;
  std::size_t next_ = 0;
};

class RegionLoop : public PipelineLoop {
 protected:
  std::vector<Sample> samples_of(FrameSource& source) {
    outputs_.clear();
    run(source, std::make_unique<Recorder>());
    return recorder().samples;
  }

  void expect_same(const std::vector<Sample>& part, const std::vector<Sample>& whole) {
    ASSERT_EQ(part.size(), whole.size());
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_EQ(part[i].status, whole[i].status) << "frame " << i;
      EXPECT_EQ(part[i].displacement, whole[i].displacement) << "frame " << i;
      EXPECT_EQ(part[i].displacement_sigma, whole[i].displacement_sigma) << "frame " << i;
      EXPECT_EQ(part[i].wrench, whole[i].wrench) << "frame " << i;
    }
  }
};

TEST_F(RegionLoop, PixelsThatWereNotAskedForAreNeverRead) {
  const std::vector<Picture> pictures = pushed_about(50);
  Pictures whole(pictures);
  const std::vector<Sample> reference = samples_of(whole);
  ASSERT_EQ(reference.back().status, Status::ok);
  Pictures inner(pictures);
  PoisonedSource poisoned(inner);
  expect_same(samples_of(poisoned), reference);
}

TEST_F(RegionLoop, OnceTheTargetIsHeldLessThanHalfOfTheFrameIsDecoded) {
  const std::vector<Picture> pictures = pushed_about(50);
  Pictures inner(pictures);
  PoisonedSource poisoned(inner);
  const std::vector<Sample> samples = samples_of(poisoned);
  for (std::size_t i = kRestFrames + 1; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].status, Status::ok) << "frame " << i;
    const auto& [decoded, completed] = poisoned.deliveries()[i];
    EXPECT_LT(decoded.width * decoded.height, kWidth * kHeight / 2) << "frame " << i;
    EXPECT_FALSE(completed) << "frame " << i;
  }
}

TEST_F(RegionLoop, ATargetThatJumpsOutOfTheRegionIsFoundInTheSameFrame) {
  const std::vector<Picture> pictures = pushed_about(20, 12, 16);
  Pictures whole(pictures);
  const std::vector<Sample> reference = samples_of(whole);
  Pictures inner(pictures);
  PoisonedSource poisoned(inner);
  const std::vector<Sample> samples = samples_of(poisoned);
  expect_same(samples, reference);
  EXPECT_NEAR(samples[12].displacement[0], pushed(12)[0] + kJump, 4e-6) << "m";
  for (const std::size_t jump : {12U, 16U}) {
    EXPECT_TRUE(carries_numbers(samples[jump].status)) << "frame " << jump;
    EXPECT_TRUE(poisoned.deliveries()[jump].completed) << "frame " << jump;
  }
}

TEST_F(RegionLoop, AFrameThatCannotBeCompletedCarriesNoNumbersAndTheNextIsWhole) {
  const std::vector<Picture> pictures = pushed_about(20, 12, 20);
  Pictures inner(pictures);
  PoisonedSource poisoned(inner);
  poisoned.rest_is_damaged = true;
  const std::vector<Sample> samples = samples_of(poisoned);
  EXPECT_EQ(samples[11].status, Status::ok);
  EXPECT_FALSE(carries_numbers(samples[12].status));
  EXPECT_EQ(poisoned.deliveries()[13].decoded, (Region{0, 0, kWidth, kHeight}));
  EXPECT_TRUE(carries_numbers(samples[13].status));
}

}  // namespace
}  // namespace tagwrench::test
