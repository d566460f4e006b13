// A recording as a source: what was decoded is decoded again, and nothing more.
#include "host/source/replay.h"

#include <poll.h>

#include "host/source/frame_source.h"
#include "tests/unit/recording/recorded.h"

namespace tagwrench::record::test {
namespace {

using Replay = Folder;

std::unique_ptr<RecordingSource> replay(const std::filesystem::path& path, bool fast = true) {
  return std::make_unique<RecordingSource>(std::make_unique<RecordingReader>(path), fast);
}

TEST_F(Replay, FramesHaveTheirPixelsTimesAndLatency) {
  write_recording(path(), 4);
  const auto source = replay(path());
  EXPECT_EQ(source->poll_fd(), -1);
  Frame frame;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(source->read(frame), ReadStatus::frame);
    EXPECT_EQ(frame.capture_time, at_ms(1000 + 40 * i));
    EXPECT_EQ(frame.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.recorded_latency, std::chrono::microseconds(812));
    const auto pixels = picture(i);
    EXPECT_TRUE(std::equal(pixels.begin(), pixels.end(), frame.image.pixels));
  }
  EXPECT_EQ(source->read(frame), ReadStatus::end);
  EXPECT_EQ(source->unusable(), "");
}

TEST_F(Replay, OfAKeptRegionNoMoreIsShownThanWasDecodedThen) {
  const Region part{8, 4, 10, 6};
  {
    RecordingWriter writer({.path = path()}, head(Keep::region));
    for (int i = 0; i < 3; ++i) {
      const auto pixels = picture(i);
      Frame f = frame(i, pixels);
      if (i > 0) f.decoded = part;
      const Region first = f.readable();
      if (i == 2) f.decoded = {};  // completed
      writer.frame(f, first, grey(pixels));
    }
  }
  const auto source = replay(path());
  Frame frame;
  ASSERT_EQ(source->read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), (Region{0, 0, kWidth, kHeight}));
  ASSERT_EQ(source->read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), part);
  const auto pixels = picture(1);
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int x = part.x; x < part.x + part.width; ++x)
      ASSERT_EQ(frame.image.pixels[y * frame.image.stride + x],
                pixels[static_cast<std::size_t>(y * kWidth + x)]);
  }
  EXPECT_FALSE(source->complete(frame)) << "there is no more";
  EXPECT_EQ(frame.readable(), part);
  ASSERT_EQ(source->read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), part);
  EXPECT_TRUE(source->complete(frame));
  EXPECT_EQ(frame.readable(), (Region{0, 0, kWidth, kHeight}));
  const auto whole = picture(2);
  EXPECT_TRUE(std::equal(whole.begin(), whole.end(), frame.image.pixels));
}

TEST_F(Replay, ARegionSourceShowsWhatWasAskedForAndCompletes) {
  write_recording(path(), 3);
  RegionSource source(replay(path()));
  Frame frame;
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), (Region{0, 0, kWidth, kHeight}));
  source.want({30, 20, 10, 10});
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), (Region{30, 20, 2, 4})) << "what of it lies in the picture";
  EXPECT_TRUE(source.complete(frame));
  EXPECT_EQ(frame.readable(), (Region{0, 0, kWidth, kHeight}));
}

TEST_F(Replay, PacedByItsTimesALoopThatIsLateLosesFrames) {
  write_recording(path(), 10);
  const auto source = replay(path(), false);
  Frame frame;
  ASSERT_EQ(source->read(frame), ReadStatus::frame);
  const timespec late{0, 130'000'000};
  ::nanosleep(&late, nullptr);
  ASSERT_EQ(source->read(frame), ReadStatus::frame);
  EXPECT_GE(frame.sequence, 3U);
  EXPECT_EQ(frame.dropped, frame.sequence - 1);
  std::uint64_t last = frame.sequence;
  for (ReadStatus status = ReadStatus::nothing; status != ReadStatus::end;) {
    pollfd entry{source->poll_fd(), POLLIN, 0};
    ASSERT_EQ(::poll(&entry, 1, -1), 1);
    status = source->read(frame);
    if (status == ReadStatus::frame) last = frame.sequence;
  }
  EXPECT_EQ(last, 9U);
}

TEST_F(Replay, ARecordingWithoutPicturesSaysWhatToDo) {
  write_recording(path(), 2, Keep::none);
  EXPECT_NE(refusal([&] { replay(path()); }).find("tagwrench export"), std::string::npos);
  EXPECT_EQ(RecordingReader(path()).frame_times().size(), 2U);
}

}  // namespace
}  // namespace tagwrench::record::test
