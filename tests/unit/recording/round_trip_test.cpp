// What was written is what is read, and what is no recording of ours is refused in one line.
#include <sqlite3.h>

#include <cmath>
#include <fstream>

#include "host/recording/database.h"
#include "tests/unit/recording/recorded.h"

namespace tagwrench::record::test {
namespace {

using RoundTrip = Folder;

TEST_F(RoundTrip, EverythingReadsBackToTheSameBits) {
  write_recording(path(), 5);
  RecordingReader reader(path());
  EXPECT_TRUE(reader.head().closed);
  EXPECT_EQ(reader.head().width, kWidth);
  EXPECT_EQ(reader.head().period, std::chrono::milliseconds(40));
  EXPECT_EQ(reader.head().keep, Keep::raw);
  EXPECT_EQ(reader.head().sensor_yaml, "camera: {}\n");
  EXPECT_EQ(reader.head().appearance, head().appearance);
  const auto sorted = [](auto files) {
    std::sort(files.begin(), files.end());
    return files;
  };
  EXPECT_EQ(sorted(reader.head().measured), sorted(head().measured));
  EXPECT_EQ(reader.head().more, head().more);
  EXPECT_EQ(reader.frame_times().size(), 5U);

  Entry entry;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(reader.next(entry));
    const auto pixels = picture(i);
    EXPECT_EQ(entry.kind, Entry::Kind::frame);
    EXPECT_EQ(entry.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(entry.time, at_ms(1000 + 40 * i));
    EXPECT_EQ(entry.raw.fourcc, fourcc("GREY"));
    EXPECT_EQ(entry.raw.stride, kWidth);
    EXPECT_TRUE(
        std::equal(pixels.begin(), pixels.end(), entry.raw.bytes.begin(), entry.raw.bytes.end()));
    EXPECT_EQ(entry.latency, std::chrono::microseconds(812));
  }
  EXPECT_FALSE(reader.next(entry));

  TrackRecord record;
  ASSERT_TRUE(reader.next(record));
  ASSERT_TRUE(reader.next(record));
  EXPECT_EQ(record.time, at_ms(1040));
  EXPECT_EQ(record.track.displacement, track(1).displacement);
  EXPECT_EQ(record.track.covariance, track(1).covariance);
  ASSERT_EQ(record.track.corner_count, 2);
  EXPECT_EQ(record.track.corners[1].id, 2);
  EXPECT_EQ(record.track.corners[1].px, track(1).corners[1].px);

  Sample read;
  ASSERT_TRUE(reader.next(read));
  const auto pixels = picture(0);
  EXPECT_EQ(read.wrench, sample(frame(0, pixels)).wrench);
  EXPECT_EQ(read.output_time - read.latency_origin, std::chrono::microseconds(812));

  ReferenceRecord reading;
  ASSERT_TRUE(reader.next(reading));
  EXPECT_EQ(reading.channel, 1);
  EXPECT_EQ(reading.value[0], 0.5);
  EXPECT_TRUE(std::isnan(reading.sigma[0])) << "not known";

  ASSERT_EQ(reader.marks().size(), 2U);
  EXPECT_TRUE(reader.marks()[0].begin);
  EXPECT_EQ(reader.marks()[1].time, at_ms(1060));
  EventRecord event;
  ASSERT_TRUE(reader.next(event));
  EXPECT_EQ(event.text, "a note");
  EXPECT_EQ(reader.marks()[0].id, event.id + 1);
  EXPECT_EQ(reader.marks()[1].id, event.id + 2);
}

TEST_F(RoundTrip, AMissingFrameAndALostCameraKeepTheirPlaces) {
  {
    RecordingWriter writer({.path = path()}, head());
    write_frames(writer, 0, 2);
    const auto pixels = picture(1);
    Sample lost = sample(frame(1, pixels));
    lost.output_time = lost.latency_origin + std::chrono::milliseconds(80);
    writer.missing(lost);
    writer.event(EventKind::disconnected, at_ms(1200), "gone");
    writer.event(EventKind::reconnected, at_ms(1300), "back");
    write_frames(writer, 10, 11);
  }
  RecordingReader reader(path());
  std::vector<Entry::Kind> kinds;
  for (Entry entry; reader.next(entry);) {
    kinds.push_back(entry.kind);
    if (entry.kind == Entry::Kind::missing) {
      EXPECT_EQ(entry.latency, std::chrono::milliseconds(80));
      EXPECT_EQ(entry.time, at_ms(1120)) << "80 ms after the last frame";
    }
    if (entry.kind == Entry::Kind::disconnected) {
      EXPECT_EQ(entry.text, "gone");
    }
  }
  using enum Entry::Kind;
  EXPECT_EQ(kinds, (std::vector{frame, frame, missing, disconnected, reconnected, frame}));
}

TEST_F(RoundTrip, AClosedRecordingIsOneFile) {
  write_recording(path(), 3);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(RoundTrip, AFileThatExistsIsNotTouched) {
  std::ofstream(path()) << "somebody's";
  EXPECT_NE(refusal([&] { RecordingWriter writer({.path = path()}, head()); }).find("exists"),
            std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(path()), 10U);
}

TEST_F(RoundTrip, NobodysFilesLieBesideIt) {
  for (const char* part : {"-wal", "-shm", "-journal"}) {
    const std::string beside = path().string() + part;
    std::ofstream(beside).flush();  // of somebody who wants to read along
    EXPECT_NE(refusal([&] { RecordingWriter writer({.path = path()}, head()); }).find(beside),
              std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(path()));
    std::filesystem::remove(beside);
  }
}

TEST_F(RoundTrip, WhatIsWrittenIsForItsOwnerAlone) {
  RecordingWriter writer({.path = path()}, head());
  write_frames(writer, 0, 3);
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    EXPECT_EQ(entry.status().permissions() & std::filesystem::perms(0077),
              std::filesystem::perms::none)
        << entry.path();
  }
}

TEST_F(RoundTrip, OfTwoWritersTheSecondIsRefused) {
  RecordingWriter writer({.path = path()}, head());
  EXPECT_NE(refusal([&] { RecordingWriter second({.path = path()}, head()); }).find("exists"),
            std::string::npos);
  write_frames(writer, 0, 3);
  EXPECT_EQ(writer.finish(), "");
  EXPECT_EQ(RecordingReader(path()).frame_times().size(), 3U);
}

TEST_F(RoundTrip, IsReadWhileItIsWrittenAndGoesOn) {
  RecordingWriter writer({.path = path(), .commit_period = Duration(0)}, head());
  write_frames(writer, 0, 3);
  std::size_t seen = 0;
  while (seen < 3) seen = RecordingReader(path()).frame_times().size();
  EXPECT_FALSE(RecordingReader(path()).head().closed);
  write_frames(writer, 3, 6);
  EXPECT_EQ(writer.finish(), "");
  EXPECT_EQ(RecordingReader(path()).frame_times().size(), 6U);
}

TEST_F(RoundTrip, WhatIsNoRecordingIsRefusedInOneLine) {
  EXPECT_NE(refusal([&] { RecordingReader reader(path("none")); }).find("no such file"),
            std::string::npos);
  EXPECT_NE(refusal([&] { RecordingReader reader(folder_); }).find("not a file"),
            std::string::npos);
  std::ofstream(path("text")) << std::string(5000, 'x');
  EXPECT_NE(refusal([&] { RecordingReader reader(path("text")); }).find("not a recording"),
            std::string::npos);
  std::ofstream(path("empty")).flush();
  EXPECT_NE(refusal([&] { RecordingReader reader(path("empty")); }).find("not a recording"),
            std::string::npos);
  std::ofstream(path("other")).flush();
  Database(path("other"), Database::Mode::write).run("CREATE TABLE t (x)");
  const std::string other = refusal([&] { RecordingReader reader(path("other")); });
  EXPECT_NE(other.find("not a recording"), std::string::npos) << other;
  EXPECT_EQ(other.find('\n'), std::string::npos);
}

TEST_F(RoundTrip, ARecordingOfAnotherVersionIsRefused) {
  write_recording(path(), 2);
  Database(path(), Database::Mode::write).run("PRAGMA user_version = 7");
  EXPECT_NE(refusal([&] { RecordingReader reader(path()); }).find("format 7"), std::string::npos);
}

TEST_F(RoundTrip, TimeThatRunsBackwardsIsNamed) {
  write_recording(path(), 4);
  Database(path(), Database::Mode::write)
      .run("UPDATE frames SET t_ns = t_ns - 100000000 WHERE seq = 2");
  const std::string line = refusal([&] { RecordingReader reader(path()); });
  EXPECT_NE(line.find("time runs backwards: frame 3 has t_ns 980000000"), std::string::npos)
      << line;
}

TEST_F(RoundTrip, ASlowDiskCostsPixelsFirstAndSaysSo) {
  // So long between commits and so small a buffer that the disk might as well stand still.
  constexpr std::size_t kBuffer = (2 << 20) + 40'000;
  RecordingWriter writer({.path = path(), .buffer_bytes = kBuffer}, head());
  std::vector<std::uint8_t> big(30'000);
  const auto pixels = picture(0);
  Frame f = frame(0, pixels);
  while (writer.state().lost_frames == 0) {
    writer.frame(f, f.readable(), {fourcc("MJPG"), big, 0});
    writer.sample(sample(f));
    f.capture_time += std::chrono::milliseconds(1);
    ++f.sequence;
  }
  EXPECT_EQ(writer.state().lost_others, 0U);
  const std::uint64_t frames = writer.state().frames;
  EXPECT_EQ(writer.finish(), "");
  RecordingReader reader(path());
  EXPECT_EQ(reader.frame_times().size(), frames) << "their rows are there";
  std::uint64_t without = 0;
  for (Entry entry; reader.next(entry);) without += entry.raw.bytes.empty() ? 1 : 0;
  EXPECT_EQ(without, writer.state().lost_frames);
}

}  // namespace
}  // namespace tagwrench::record::test
