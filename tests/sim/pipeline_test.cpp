// The loop itself: what it does when frames come, when they stop coming, and when an output dies.
#include "tests/sim/played.h"

namespace tagwrench::test {
namespace {

TEST_F(PipelineLoop, EveryFrameBecomesOneSampleInOrder) {
  PlayedSource source(kFrames, PlayedSource::After::end);
  const RunReport report = run(source, std::make_unique<Recorder>());
  EXPECT_EQ(report.end, RunReport::End::source_ended);
  EXPECT_EQ(report.frames, static_cast<std::uint64_t>(kFrames));
  ASSERT_EQ(recorder().samples.size(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < recorder().samples.size(); ++i)
    EXPECT_EQ(recorder().samples[i].sequence, i);
  EXPECT_EQ(recorder().samples.front().status, Status::acquiring);
  EXPECT_EQ(recorder().samples.back().status, Status::ok);
  // Pushed along camera z, which is up: the HID puck moves up, toward negative Z.
  EXPECT_GT(recorder().samples.back().wrench[2], 0.5);
  EXPECT_LT(recorder().samples.back().deflection[2], -0.2);
}

TEST_F(PipelineLoop, AMissingFrameIsOneLostSampleWithZeros) {
  PlayedSource source(kFrames, PlayedSource::After::silence);
  RunLimits limits;
  limits.time = std::chrono::seconds(60);  // only if no neutral sample comes
  auto recorder_of_loss = std::make_unique<Recorder>([this](const Sample& sample) {
    if (sample.status == Status::lost) ::eventfd_write(stop_.get(), 1);
    return SendStatus::ok;
  });
  const RunReport report = run(source, std::move(recorder_of_loss), limits);
  EXPECT_EQ(report.end, RunReport::End::interrupted) << "no neutral sample came";
  EXPECT_EQ(report.frames, static_cast<std::uint64_t>(kFrames)) << "a missing frame is not a frame";
  ASSERT_EQ(recorder().samples.size(), static_cast<std::size_t>(kFrames) + 1);
  EXPECT_EQ(recorder().samples.back().deflection, Vector6::Zero().eval());
  EXPECT_EQ(recorder().samples.back().wrench, Vector6::Zero().eval());
}

TEST_F(PipelineLoop, ADisconnectedCameraIsNeutralAtOnceAndSaid) {
  PlayedSource source(kFrames, PlayedSource::After::disconnect);
  RunLimits limits;
  limits.time = std::chrono::seconds(60);  // only if no neutral sample comes
  const RunReport report = run(source, std::make_unique<Recorder>([this](const Sample& sample) {
                                 if (sample.status == Status::lost) ::eventfd_write(stop_.get(), 1);
                                 return SendStatus::ok;
                               }),
                               limits);
  EXPECT_EQ(report.end, RunReport::End::interrupted) << "no neutral sample came";
  ASSERT_FALSE(recorder().notices.empty());
  EXPECT_EQ(recorder().notices.back(), "the camera went away");
}

/// Shows the next picture of the clip when asked to, then none.
class AskedSource final : public FrameSource {
 public:
  AskedSource() { format_ = {640, 480, std::chrono::milliseconds(40), "asked"}; }
  void ask() { ::eventfd_write(ready_.get(), 1); }
  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return ready_.get(); }
  ReadStatus read(Frame& frame) noexcept override {
    std::uint64_t drained = 0;
    if (::read(ready_.get(), &drained, sizeof drained) < 0) return ReadStatus::nothing;
    if (next_ == kFrames) return ReadStatus::nothing;
    frame = {};
    frame.image = {Clip::get().pictures[static_cast<std::size_t>(next_)].data(), 640, 480, 640};
    frame.latency_origin = std::chrono::steady_clock::now();
    frame.capture_time = TimePoint{} + next_ * format_.period;
    frame.sequence = static_cast<std::uint64_t>(next_++);
    return ReadStatus::frame;
  }
  std::string detail() const override { return {}; }

 private:
  UniqueFd ready_{::eventfd(1, EFD_NONBLOCK)};
  SourceFormat format_;
  int next_ = 0;
};

TEST_F(PipelineLoop, DevicesMoveBetweenFramesAndAreNeutralAtOnceWhenTheyStop) {
  AskedSource source;
  auto device = std::make_unique<Recorder>();
  int of_this_frame = 0;
  int most = 0;
  std::uint64_t last = 0;
  device->on_move = [&](const Sample& sample) {
    of_this_frame = sample.sequence == last ? of_this_frame + 1 : 1;
    last = sample.sequence;
    most = std::max(most, of_this_frame);
    // The next frame when the device has moved three times on this one; a stalled machine loses it.
    const bool numbers = carries_numbers(sample.status);
    if (!numbers || of_this_frame == 3) source.ask();
    if (sample.status == Status::lost && last + 1 == kFrames) ::eventfd_write(stop_.get(), 1);
  };
  RunLimits limits;
  limits.time = std::chrono::seconds(60);  // only if no neutral move comes
  const RunReport report = run(source, std::move(device), limits);
  EXPECT_EQ(report.end, RunReport::End::interrupted) << "no neutral move came";
  EXPECT_GE(most, 3) << "they moved with frames only";
  EXPECT_GE(recorder().samples.size(), static_cast<std::size_t>(kFrames));
  const Sample& end = recorder().moves.back();
  EXPECT_EQ(end.status, Status::lost);
  EXPECT_TRUE(end.deflection.isZero());
  EXPECT_EQ(end.buttons, 0U);
  bool carried_on = false;
  for (std::size_t i = 1; i < recorder().moves.size(); ++i) {
    const Sample& before = recorder().moves[i - 1];
    const Sample& after = recorder().moves[i];
    ASSERT_LE(after.deflection.cwiseAbs().maxCoeff(), 1);
    carried_on =
        carried_on || (after.sequence == before.sequence && carries_numbers(after.status) &&
                       after.deflection != before.deflection);
  }
  EXPECT_TRUE(carried_on) << "motion stands still between frames";
}

TEST_F(PipelineLoop, AFailedOutputEndsTheRunWithItsReason) {
  PlayedSource source(kFrames, PlayedSource::After::end);
  const RunReport report = run(source, std::make_unique<Recorder>([](const Sample& sample) {
                                 return sample.sequence == 3 ? SendStatus::failed : SendStatus::ok;
                               }));
  EXPECT_EQ(report.end, RunReport::End::output_failed);
  EXPECT_EQ(report.failure, "recorder: broken on purpose");
  EXPECT_EQ(recorder().samples.size(), 4u);
}

TEST_F(PipelineLoop, SkippedSamplesAreCounted) {
  PlayedSource source(kFrames, PlayedSource::After::end);
  const RunReport report =
      run(source, std::make_unique<Recorder>([](const Sample& sample) {
            return sample.sequence % 2 == 0 ? SendStatus::skipped : SendStatus::ok;
          }));
  EXPECT_EQ(report.skipped, 6u);
}

TEST_F(PipelineLoop, EndsAfterTheFramesAskedFor) {
  PlayedSource source(kFrames, PlayedSource::After::silence);
  RunLimits limits;
  limits.frames = 4;
  EXPECT_EQ(run(source, std::make_unique<Recorder>(), limits).frames, 4u);
}

/// Shows the clip, then black for two seconds, and that once more.
class BlackedOut final : public FrameSource {
 public:
  BlackedOut() { format_ = {640, 480, std::chrono::milliseconds(40), "blacked out"}; }
  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return -1; }
  ReadStatus read(Frame& frame) noexcept override {
    constexpr int kBlack = 50;
    if (next_ == 2 * (kFrames + kBlack)) return ReadStatus::end;
    const int at = next_ % (kFrames + kBlack);
    frame = {};
    frame.image = {
        at < kFrames ? Clip::get().pictures[static_cast<std::size_t>(at)].data() : black_.data(),
        640, 480, 640};
    frame.latency_origin = std::chrono::steady_clock::now();
    frame.capture_time = TimePoint{} + next_ * format_.period;
    frame.sequence = static_cast<std::uint64_t>(next_++);
    return ReadStatus::frame;
  }

 private:
  SourceFormat format_;
  std::vector<std::uint8_t> black_ = std::vector<std::uint8_t>(640 * 480, 3);
  int next_ = 0;
};

TEST_F(PipelineLoop, ATroubleIsSaidEachTimeItComesAndTakenAwayWhenItHasGone) {
  BlackedOut source;
  run(source, std::make_unique<Recorder>());
  const std::vector<std::string>& said = recorder().notices;
  ASSERT_EQ(said.size(), 4U);
  EXPECT_NE(said[0].find("rest pose learned"), std::string::npos);
  EXPECT_NE(said[1].find("black"), std::string::npos);
  EXPECT_EQ(said[2], "");
  EXPECT_EQ(said[3], said[1]);
}

TEST_F(PipelineLoop, AHintIsSaidOnce) {
  PlayedSource source(kFrames, PlayedSource::After::end);
  run(source, std::make_unique<Recorder>());
  ASSERT_EQ(recorder().notices.size(), 1u);
  EXPECT_NE(recorder().notices[0].find("rest pose learned"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test
