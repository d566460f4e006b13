#include <gtest/gtest.h>
#include <poll.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "host/source/replay.h"
#include "tests/unit/source/jpeg_fixture.h"
#include "tests/unit/source/message.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class Images : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ =
        fs::path(::testing::TempDir()) /
        ("images_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(dir_);
    fs::create_directories(dir_);
  }
  void TearDown() override { fs::remove_all(dir_); }

  /// A picture of one grey level.
  void picture(const std::string& name, int level, int width = 16, int height = 12) const {
    cv::imwrite((dir_ / name).string(), cv::Mat(height, width, CV_8UC1, cv::Scalar(level)));
  }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(dir_ / name, std::ios::binary) << bytes;
  }
  void cut_in_half(const std::string& name) const {
    fs::resize_file(dir_ / name, fs::file_size(dir_ / name) / 2);
  }
  std::string refused() const {
    return refusal([&] { ImagesSource source(dir_.string(), true); });
  }
  std::string dir() const { return dir_.string(); }

  fs::path dir_;
};

ReadStatus wait_and_read(ImagesSource& source, Frame& frame) {
  ReadStatus status = ReadStatus::nothing;
  while (status == ReadStatus::nothing) {
    pollfd entry{source.poll_fd(), POLLIN, 0};
    EXPECT_GE(::poll(&entry, 1, -1), 1);
    status = source.read(frame);
  }
  return status;
}

int level(const Frame& frame) { return frame.image.pixels[5 * frame.image.stride + 7]; }

TEST_F(Images, FastDeliversEveryPictureInNameOrderAndThenEnds) {
  picture("b.pgm", 20);
  picture("a.png", 10);
  picture("c.JPG", 30);
  picture("d.jpeg", 40);
  write("notes.txt", "not a picture");
  ImagesSource source(dir(), true);
  EXPECT_EQ(source.poll_fd(), -1);
  EXPECT_EQ(source.format().width, 16);
  EXPECT_EQ(source.format().height, 12);
  EXPECT_EQ(source.format().period, 40ms);
  Frame frame;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    EXPECT_EQ(level(frame), 10 * (i + 1));
    EXPECT_EQ(frame.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.dropped, 0U);
    EXPECT_EQ(frame.capture_time, TimePoint(i * 40ms));
  }
  EXPECT_EQ(source.read(frame), ReadStatus::end);
  EXPECT_EQ(source.read(frame), ReadStatus::end);
}

TEST_F(Images, TimesComeFromFramesCsv) {
  picture("a.png", 10);
  picture("b.png", 20);
  picture("c.png", 30);
  write("frames.csv", "file,t_ns\na.png,1000\nb.png,5000\nc.png,21000\n");
  ImagesSource source(dir(), true);
  EXPECT_EQ(source.format().period, 10us);
  Frame frame;
  const auto before = std::chrono::steady_clock::now();
  for (const Duration expected : {1us, 5us, 21us}) {
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    EXPECT_EQ(frame.capture_time, TimePoint(expected));
    EXPECT_GE(frame.latency_origin, before) << "latency counts from the hand-over";
  }
}

TEST_F(Images, PacedFramesAreNeverEarly) {
  for (int i = 0; i < 4; ++i) picture("000" + std::to_string(i) + ".png", 10 * i);
  write("frames.csv", "0000.png,100\n0001.png,15000100\n0002.png,30000100\n0003.png,45000100\n");
  ImagesSource source(dir(), false);
  Frame frame;
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t accounted = 0;
  ReadStatus status;
  while ((status = wait_and_read(source, frame)) == ReadStatus::frame) {
    accounted += 1 + frame.dropped;
    EXPECT_EQ(level(frame), static_cast<int>(10 * frame.sequence));
    EXPECT_GE(std::chrono::steady_clock::now() - start, static_cast<int>(frame.sequence) * 15ms);
  }
  EXPECT_EQ(status, ReadStatus::end);
  EXPECT_EQ(accounted, 4U);
}

TEST_F(Images, TheClockStartsAtTheFirstReadNotAtConstruction) {
  picture("a.png", 10);
  picture("b.png", 20);
  write("frames.csv", "a.png,0\nb.png,1\n");  // b is due 1 ns after a
  ImagesSource source(dir(), false);
  Frame frame;
  ASSERT_EQ(wait_and_read(source, frame), ReadStatus::frame);
  EXPECT_EQ(frame.sequence, 0U);
}

TEST_F(Images, ALateLoopLosesFramesAndCountsThem) {
  for (int i = 0; i < 6; ++i) picture("000" + std::to_string(i) + ".png", 10 * i);
  // The first, then five that are all due by the time anybody can ask.
  write("frames.csv", "0000.png,0\n0001.png,1\n0002.png,2\n0003.png,3\n0004.png,4\n0005.png,5\n");
  ImagesSource source(dir(), false);
  Frame frame;
  ASSERT_EQ(wait_and_read(source, frame), ReadStatus::frame);
  ASSERT_EQ(wait_and_read(source, frame), ReadStatus::frame);
  EXPECT_EQ(frame.sequence, 5U);
  EXPECT_EQ(frame.dropped, 4U);
  EXPECT_EQ(level(frame), 50);
  EXPECT_EQ(wait_and_read(source, frame), ReadStatus::end);
}

TEST_F(Images, APictureThatTurnsOutCorruptIsSkippedAndCounted) {
  picture("a.png", 10);
  picture("b.png", 20);
  picture("c.pgm", 25);
  const auto jpeg = jpeg_of(pattern(16, 12), 16, 12);
  write("d.jpg", std::string(jpeg.begin(), jpeg.end()));
  picture("e.png", 30);
  ImagesSource source(dir(), true);
  for (const char* name : {"b.png", "c.pgm"}) cut_in_half(name);
  fs::resize_file(dir_ / "d.jpg", jpeg.size() - 10);
  Frame frame;
  testing::internal::CaptureStderr();
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(source.read(frame), ReadStatus::nothing) << i;
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "what to say is the caller's";
  EXPECT_EQ(level(frame), 30);
  EXPECT_EQ(frame.dropped, 3U);
  EXPECT_EQ(source.corrupt_frames(), 3U);
  EXPECT_NE(source.unusable().find("b.png: is damaged"), std::string::npos) << source.unusable();
  EXPECT_NE(source.unusable().find("2 others"), std::string::npos) << source.unusable();
}

TEST_F(Images, APictureThatVanishesOrChangesSizeIsSkipped) {
  picture("a.png", 10);
  picture("b.png", 20);
  picture("c.png", 30);
  ImagesSource source(dir(), true);
  fs::remove(dir_ / "a.png");
  picture("b.png", 20, 32, 32);
  Frame frame;
  EXPECT_EQ(source.read(frame), ReadStatus::nothing);
  EXPECT_EQ(source.read(frame), ReadStatus::nothing);
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.dropped, 2U);
}

TEST_F(Images, AFolderThatDoesNotExistIsRefused) {
  fs::remove_all(dir_);
  EXPECT_TRUE(names(refused(), {dir().c_str(), "no such folder"}));
}

TEST_F(Images, AnEmptyFolderIsRefused) {
  write("notes.txt", "");
  EXPECT_TRUE(names(refused(), {dir().c_str(), "no PNG, PGM or JPEG"}));
}

TEST_F(Images, MixedSizesAreRefusedWithBothNames) {
  picture("a.png", 10);
  picture("b.png", 20);
  picture("z.pgm", 30, 16, 13);
  EXPECT_TRUE(names(refused(), {"a.png", "16x12", "z.pgm", "16x13"}));
}

TEST_F(Images, OddOnesAreSetAsideWhereThatIsAskedFor) {
  picture("a.png", 10, 16, 13);
  picture("b.png", 20);
  picture("c.png", 30);
  write("d.png", "this is text");
  ImagesSource source(dir(), true, OddPictures::set_aside);
  EXPECT_EQ(source.count(), 2u);
  EXPECT_EQ(fs::path(source.path_of(0)).filename(), "b.png");
  EXPECT_EQ(source.format().height, 12);
  ASSERT_EQ(source.set_aside().size(), 2u);
  EXPECT_EQ(source.set_aside()[0].size, (ImageSize{16, 13}));
  EXPECT_EQ(fs::path(source.set_aside()[1].path).filename(), "d.png");
  EXPECT_FALSE(source.set_aside()[1].size);
}

TEST_F(Images, AFolderOfOddOnesAloneIsRefused) {
  write("d.png", "this is text");
  const std::string said =
      refusal([&] { ImagesSource source(dir(), true, OddPictures::set_aside); });
  EXPECT_TRUE(names(said, {dir().c_str(), "none of its pictures can be read"}));
}

TEST_F(Images, AnUnreadablePictureIsRefused) {
  picture("a.png", 10);
  write("b.png", "this is text");
  EXPECT_TRUE(names(refused(), {"b.png", "not a readable"}));
}

TEST_F(Images, AnEmptyPictureIsRefused) {
  write("a.png", "");
  EXPECT_TRUE(names(refused(), {"a.png", "not a readable"}));
}

TEST_F(Images, FramesCsvThatNamesAMissingFileIsRefused) {
  picture("a.png", 10);
  write("frames.csv", "file,t_ns\na.png,0\nb.png,40\n");
  EXPECT_TRUE(names(refused(), {"frames.csv:3:", "b.png"}));
}

TEST_F(Images, FramesCsvThatGoesBackInTimeIsRefused) {
  picture("a.png", 10);
  picture("b.png", 20);
  write("frames.csv", "file,t_ns\na.png,40\nb.png,40\n");
  EXPECT_TRUE(names(refused(), {"frames.csv:3:", "b.png"}));
}

TEST_F(Images, OnePictureIsEnough) {
  picture("a.png", 10);
  ImagesSource source(dir(), false);
  EXPECT_EQ(source.format().period, 40ms);
  Frame frame;
  EXPECT_EQ(wait_and_read(source, frame), ReadStatus::frame);
  EXPECT_EQ(wait_and_read(source, frame), ReadStatus::end);
}

/// Grey levels of a 160 x 120 JPEG in `region`.
std::vector<int> levels(const Frame& frame, const Region& region) {
  std::vector<int> out;
  for (int y = region.y; y < region.y + region.height; ++y) {
    for (int x = region.x; x < region.x + region.width; ++x) {
      out.push_back(frame.image.pixels[y * frame.image.stride + x]);
    }
  }
  return out;
}

TEST_F(Images, OnlyTheWantedPartOfAJpegIsDecodedUntilTheRestIsAskedFor) {
  const auto jpeg = jpeg_of(pattern(160, 120), 160, 120);
  write("a.jpg", std::string(jpeg.begin(), jpeg.end()));
  write("b.jpg", std::string(jpeg.begin(), jpeg.end()));
  ImagesSource source(dir(), true);
  const Region whole{0, 0, 160, 120}, wanted{50, 30, 40, 40};
  Frame all, part;
  ASSERT_EQ(source.read(all), ReadStatus::frame);
  EXPECT_EQ(all.readable(), whole);
  const std::vector<int> truth = levels(all, whole);
  const std::vector<int> truth_of_part = levels(all, wanted);
  source.want(wanted);
  ASSERT_EQ(source.read(part), ReadStatus::frame);
  EXPECT_TRUE(part.readable().contains(wanted));
  EXPECT_LT(part.readable().width, 80);
  EXPECT_EQ(levels(part, wanted), truth_of_part);
  ASSERT_TRUE(source.complete(part));
  EXPECT_EQ(part.readable(), whole);
  EXPECT_EQ(levels(part, whole), truth);
  EXPECT_TRUE(source.complete(part)) << "of a whole frame is nothing to do";
}

TEST_F(Images, AJpegCutOffBelowTheWantedPartIsGoodButCannotBeCompleted) {
  const auto jpeg = jpeg_of(pattern(160, 120), 160, 120);
  write("a.jpg", std::string(jpeg.begin(), jpeg.end() - 200));
  ImagesSource source(dir(), true);
  const Region wanted{50, 30, 40, 40};
  source.want(wanted);
  Frame frame;
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  const Region decoded = frame.decoded;
  const std::vector<int> before = levels(frame, wanted);
  EXPECT_FALSE(source.complete(frame));
  EXPECT_EQ(frame.decoded, decoded);
  EXPECT_EQ(levels(frame, wanted), before);
}

TEST_F(Images, APngIsWholeWhateverIsWanted) {
  picture("a.png", 10);
  ImagesSource source(dir(), true);
  source.want({2, 2, 3, 3});
  Frame frame;
  frame.decoded = {1, 1, 1, 1};  // left by another frame
  ASSERT_EQ(source.read(frame), ReadStatus::frame);
  EXPECT_EQ(frame.readable(), (Region{0, 0, 16, 12}));
  EXPECT_TRUE(source.complete(frame));
}

}  // namespace
}  // namespace tagwrench
