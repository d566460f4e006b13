// Frames of which only the part around the target is decoded: the run is the same to the last bit,
// and a target that has left this part is found in the same frame.
#include <cstdlib>

#include "tests/sim/played.h"
#include "tests/support/poisoned_source.h"

namespace tagwrench::test {
namespace {

constexpr int kWidth = 640, kHeight = 480;

using Picture = std::vector<std::uint8_t>;

/// The platform at rest, then pushed about in all six axes.
std::vector<Picture> pushed_about(int frames) {
  sim::Scenario scenario;
  scenario.trajectory.motion = sim::Motion::compound;
  scenario.trajectory.rest_time = kRestFrames / scenario.camera.frame_rate;
  SimulatorSource source(scenario, /*live=*/false);
  std::vector<Picture> pictures;
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    source.read(frame);
    pictures.emplace_back(frame.image.pixels, frame.image.pixels + kWidth * kHeight);
  }
  return pictures;
}

/// The picture moved to the right by whole columns; grey comes in from the left.
Picture moved(const Picture& picture, int columns) {
  Picture out(picture.size(), 128);
  for (int y = 0; y < kHeight; ++y) {
    std::copy_n(picture.begin() + y * kWidth, kWidth - columns, out.begin() + y * kWidth + columns);
  }
  return out;
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
  constexpr int kJump_px = 48;  // 1.3 mm, beyond the margin of the region
  std::vector<Picture> pictures = pushed_about(20);
  for (std::size_t i = 12; i < 16; ++i) pictures[i] = moved(pictures[i], kJump_px);
  Pictures whole(pictures);
  const std::vector<Sample> reference = samples_of(whole);
  Pictures inner(pictures);
  PoisonedSource poisoned(inner);
  const std::vector<Sample> samples = samples_of(poisoned);
  expect_same(samples, reference);
  EXPECT_GT(samples[12].displacement[0], 1.0e-3) << "m";
  for (const std::size_t jump : {12U, 16U}) {
    EXPECT_TRUE(carries_numbers(samples[jump].status)) << "frame " << jump;
    EXPECT_TRUE(poisoned.deliveries()[jump].completed) << "frame " << jump;
  }
}

TEST_F(RegionLoop, AFrameThatCannotBeCompletedCarriesNoNumbersAndTheNextIsWhole) {
  constexpr int kJump_px = 48;
  std::vector<Picture> pictures = pushed_about(20);
  for (std::size_t i = 12; i < pictures.size(); ++i) pictures[i] = moved(pictures[i], kJump_px);
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
