#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/sensor_config.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

class RestPicture : public testing::Test {
 protected:
  RestPicture() {
    camera_.width_px = 64;
    camera_.height_px = 48;
    image_.width = 64;
    image_.height = 48;
    for (int i = 0; i < 64 * 48; ++i)
      image_.level.push_back(255.0F * static_cast<float>(i) / (64 * 48 - 1));
  }

  std::string complaint() const {
    testing::internal::CaptureStderr();
    const std::string line = loading();
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return line;
  }
  std::string loading() const {
    try {
      load_reference_image(folder_ / "rest.png", camera_);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "(accepted)";
  }
  void expect_refused(const std::string& what) const {
    const std::string line = complaint();
    EXPECT_NE(line.find(what), std::string::npos) << line;
    EXPECT_NE(line.find("rest.png"), std::string::npos) << line;
    EXPECT_NE(line.find("calibrate target"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
  void write(const std::string& bytes) const {
    std::ofstream(folder_ / "rest.png", std::ios::binary) << bytes;
  }
  std::string bytes() const {
    std::ifstream in(folder_ / "rest.png", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
  CameraModel camera_;
  ReferenceImage image_;
};

TEST_F(RestPicture, ComesBackToWithinAFiveHundredthOfAGreyLevel) {
  write_atomically(folder_ / "rest.png", encode_reference_image(image_));
  const ReferenceImage back = load_reference_image(folder_ / "rest.png", camera_);
  ASSERT_EQ(back.level.size(), image_.level.size());
  for (std::size_t i = 0; i < back.level.size(); ++i)
    EXPECT_NEAR(back.level[i], image_.level[i], 0.002F) << i;  // half of 1/256
}

TEST_F(RestPicture, OfWhichSizeAndLevelsDisagreeIsNone) {
  image_.level.pop_back();
  EXPECT_THROW(encode_reference_image(image_), std::invalid_argument);
}

TEST_F(RestPicture, MissingForeignAndDamagedFilesAreRefused) {
  expect_refused("cannot be read");
  write("not a picture");
  expect_refused("is not a PNG");
  write_atomically(folder_ / "rest.png", encode_reference_image(image_));
  const std::string whole = bytes();
  write(whole.substr(0, 20));
  expect_refused("is not a PNG");
  write(whole.substr(0, whole.size() / 2));
  expect_refused("is damaged");
  std::string broken = whole;
  broken[whole.size() / 2] = static_cast<char>(~broken[whole.size() / 2]);
  write(broken);
  expect_refused("is damaged");
}

TEST_F(RestPicture, FoldersAndPipesAreRefused) {
  fs::create_directory(folder_ / "rest.png");
  expect_refused("cannot be read");
  fs::remove(folder_ / "rest.png");
  ASSERT_EQ(::mkfifo((folder_ / "rest.png").c_str(), 0600), 0);
  expect_refused("cannot be read");
}

TEST_F(RestPicture, AnotherSizeOrDepthIsRefused) {
  write_atomically(folder_ / "rest.png", encode_reference_image(image_));
  camera_.width_px = 640;
  expect_refused("is 64x48, but sensor.yaml's camera is 640x48");
  camera_.width_px = 64;
  cv::imwrite((folder_ / "rest.png").string(), cv::Mat::zeros(48, 64, CV_8UC1));
  expect_refused("8-bit grey");
  cv::imwrite((folder_ / "rest.png").string(), cv::Mat::zeros(48, 64, CV_16UC3));
  expect_refused("16-bit colour");
}

TEST_F(RestPicture, SensorFileNamesItRelativeToItself) {
  write_atomically(folder_ / "rest.png", encode_reference_image(image_));
  const std::string head =
      "camera: {width: 64, height: 48, fx: 80, fy: 80, cx: 31.5, cy: 23.5}\n"
      "target: {family: aruco_original, tag_size_mm: 3.8, tags: [{id: 5}]}\n"
      "wrench: {springs: {centres_mm: [[1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0]], "
      "axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07}}\n";
  const std::string name = (folder_ / "sensor.yaml").string();
  const SensorConfig sensor =
      parse_sensor(head +
                       "rest: {frames: 12, position_mm: [0, 0, 21], rotation_rad: [0, 0, 0], "
                       "appearance: rest.png}\n",
                   name);
  ASSERT_TRUE(sensor.rest.appearance);
  EXPECT_EQ(sensor.rest.appearance->frames, 12);
  EXPECT_EQ(sensor.rest.appearance->width, 64);
  try {
    parse_sensor(head + "rest: {frames: 12, appearance: rest.png}\n", name);
    FAIL() << "an appearance without the pose that it shows was accepted";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("rest.appearance: needs position_mm"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace tagwrench
