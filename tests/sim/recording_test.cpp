// What the loop recorded goes through the loop again: the same samples, and the same gaps.
#include <sys/eventfd.h>

#include <filesystem>

#include "host/output/line_outputs.h"
#include "host/recording/writer.h"
#include "host/sensor/sensor_config.h"
#include "host/source/replay.h"
#include "tests/sim/played.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {
namespace {

/// The lines that a jsonl file would have.
std::string lines_of(const std::vector<Sample>& samples) {
  std::string text;
  LineBuffer buffer{};
  for (const Sample& sample : samples) text += json_line(buffer, sample);
  return text;
}

class Log final : public FrameLog {
 public:
  Log(const std::filesystem::path& path, record::Keep keep) : writer_({.path = path}, head(keep)) {}
  void frame(const LoggedFrame& all) noexcept override {
    writer_.frame(all.frame, all.decoded, all.raw);
    writer_.track(all.track);
    writer_.sample(all.sample);
  }
  void missing(const Sample& sample) noexcept override { writer_.missing(sample); }
  void disconnected(std::string_view detail) noexcept override {
    writer_.event(record::EventKind::disconnected, TimePoint{} + std::chrono::hours(1), detail);
  }
  void reconnected(std::string_view) noexcept override {}

 private:
  static record::Head head(record::Keep keep) {
    record::Head head;
    head.width = 640;
    head.height = 480;
    head.period = std::chrono::milliseconds(40);
    head.keep = keep;
    return head;
  }
  record::RecordingWriter writer_;
};

class RecordedLoop : public PipelineLoop {
 protected:
  /// Until the target is lost or the source ends.
  std::vector<Sample> samples_of(FrameSource& source, FrameLog* log) {
    outputs_.clear();
    outputs_.push_back(std::make_unique<Recorder>([this](const Sample& sample) {
      if (sample.status == Status::lost) ::eventfd_write(stop_.get(), 1);
      return SendStatus::ok;
    }));
    Tracker tracker(sensor_.camera, sensor_.target, sensor_.rest);
    WrenchEstimator wrench(sensor_.wrench);
    ProfileManager desk(default_profile(sensor_));
    Watchdog watchdog({});
    Pipeline(source, tracker, wrench, desk, fed(), watchdog, stop_.get(), log).run({});
    std::uint64_t stopped = 0;
    ::eventfd_read(stop_.get(), &stopped);
    return recorder().samples;
  }

  void expect_the_same_again(PlayedSource::After after, std::size_t samples) {
    const auto path = folder_ / "r.twr";
    std::vector<Sample> live;
    {
      Log log(path, record::Keep::raw);  // this source has no raw frames: pixels are kept
      PlayedSource source(kFrames, after);
      live = samples_of(source, &log);
    }
    ASSERT_EQ(live.size(), samples);
    RecordingSource source(std::make_unique<record::RecordingReader>(path), /*fast=*/true);
    const std::vector<Sample> again = samples_of(source, nullptr);
    EXPECT_EQ(lines_of(again), lines_of(live));
    EXPECT_EQ(again.back().status, live.back().status);
    if (after == PlayedSource::After::disconnect) {
      EXPECT_EQ(recorder().notices.back(), "the camera went away");
    }
  }

  test::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

TEST_F(RecordedLoop, FramesComeAgainAsTheSameSamples) {
  expect_the_same_again(PlayedSource::After::end, kFrames);
}

TEST_F(RecordedLoop, AFrameThatWasMissingIsMissingAgain) {
  expect_the_same_again(PlayedSource::After::silence, kFrames + 1);
}

TEST_F(RecordedLoop, ACameraThatWentAwayGoesAwayAgain) {
  expect_the_same_again(PlayedSource::After::disconnect, kFrames + 1);
}

}  // namespace
}  // namespace tagwrench::test
