// `tagwrench calibrate camera` as its users run it.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/cli/bridge.h"
#include "tests/unit/calibration/camera/camera_render.h"

namespace tagwrench::test {
namespace {

constexpr const char* kBoard = "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50";
constexpr int kPictures = 14;

const std::string kSensor =
    "# bought in May\n"
    "camera: {width: 640, height: 480, fx: 900, fy: 900, cx: 319.5, cy: 239.5}  # by eye\n"
    "target:\n"
    "  family: aruco_original   # the paper's\n"
    "  tag_size_mm: 3.8\n"
    "  tags: [{id: 5}, {id: 2}]\n"
    "wrench:\n"
    "  springs:\n"
    "    centres_mm: [[11, 8, -10], [-11, 8, -10], [11, -8, -10], [-11, -8, -10]]\n"
    "    axial_n_per_mm: 0.7\n"
    "    lateral_n_per_mm: 0.07\n";

class CalibrateCameraCommand : public testing::Test {
 protected:
  /// Folder of the rendered pictures, made once.
  static const std::filesystem::path& pictures() {
    static const TemporaryFolder all;
    static const std::filesystem::path folder = [] {
      const BoardRenderer renderer(parse_board(kBoard), Lens{});
      std::filesystem::path made = all / "pictures";
      std::filesystem::create_directory(made);
      int i = 0;
      for (const Placement& p : good_placements(Lens{}, kPictures, 0.5)) {
        cv::imwrite((made / (std::to_string(100 + i) + ".png")).string(),
                    renderer.render(p, static_cast<std::uint64_t>(i)));
        ++i;
      }
      return made;
    }();
    return folder;
  }
  std::filesystem::path sensor_file(const std::string& text = kSensor) {
    write_file(temporary_ / "sensor.yaml", text);
    return temporary_ / "sensor.yaml";
  }
  static Outcome calibrate(std::vector<std::string> arguments) {
    std::vector<std::string> all = {"calibrate", "camera", "--board", kBoard};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run_bridge(all);
  }
  static void expect_refused(const Outcome& o, const std::vector<std::string>& parts) {
    EXPECT_EQ(o.status, 2) << o.err;
    EXPECT_EQ(o.out, "");
    for (const std::string& part : parts)
      EXPECT_NE(o.err.find(part), std::string::npos) << "no '" << part << "' in: " << o.err;
  }

  /// The numbers of "d_m" in every sample.
  static std::string displacements(const std::string& samples) {
    std::string all;
    for (std::size_t at = 0; (at = samples.find("\"d_m\":[", at)) != std::string::npos; ++at)
      all += samples.substr(at, samples.find(']', at) - at);
    return all;
  }

  TemporaryFolder temporary_;
  std::filesystem::path camera_ = temporary_ / "measured" / "camera.yaml";
};

TEST_F(CalibrateCameraCommand, WritesCameraInfoThatRunUsesAndLeavesSensorYaml) {
  const std::filesystem::path file = sensor_file();
  const Outcome o = calibrate({"--images", pictures(), "--sensor", file});
  ASSERT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(o.out, "");
  EXPECT_EQ(read_file(file), kSensor);
  const std::string now = read_file(camera_);
  const std::size_t fx = now.find("data: [");
  EXPECT_NEAR(std::stod(now.substr(fx + 7)), Lens{}.fx, 0.002 * Lens{}.fx) << now;
  for (const char* part : {"image_width: 640", "distortion_model: plumb_bob", "mirrored: false",
                           "date: \"2", "views: ", "rms_px: 0.", "sensor: \"sensor.yaml\""})
    EXPECT_NE(now.find(part), std::string::npos) << now;
  for (const char* part : {"fx ", "+-", "reprojection error", "before: fx 900", "written: ",
                           "14 pictures used: 100.png (0.0", "a direction is known to 0."})
    EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
  const auto run = [&] {
    return run_bridge({"run", "--source", "sim", "--sensor", file, "--output", "jsonl:-",
                       "--frames", "40", "--fast"});
  };
  const Outcome with = run();
  EXPECT_EQ(with.status, 0) << with.err;
  EXPECT_NE(with.err.find("camera: measured/camera.yaml, of 2"), std::string::npos) << with.err;
  std::filesystem::rename(camera_, temporary_ / "elsewhere.yaml");
  const Outcome without = run();
  EXPECT_NE(without.err.find("camera: sensor.yaml"), std::string::npos) << without.err;
  EXPECT_NE(displacements(with.out), displacements(without.out)) << "900 px are not what is so";
}

TEST_F(CalibrateCameraCommand, MakesAWholeNewFile) {
  const std::filesystem::path file = temporary_ / "new.yaml";
  const Outcome o = calibrate({"--source", "images:" + pictures().string(), "--out", file});
  ASSERT_EQ(o.status, 0) << o.err;
  EXPECT_TRUE(std::filesystem::exists(camera_));
  const Outcome run = run_bridge({"run", "--source", "sim", "--sensor", file, "--output", "jsonl:-",
                                  "--frames", "1", "--fast"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("camera: measured/camera.yaml"), std::string::npos) << run.err;
}

TEST_F(CalibrateCameraCommand, WithOutMeasuresForACopyInAnotherFolder) {
  const std::filesystem::path file = sensor_file();
  std::filesystem::create_directory(temporary_ / "other");
  const std::filesystem::path copy = temporary_ / "other" / "it's mine.yaml";
  const Outcome o = calibrate({"--images", pictures(), "--sensor", file, "--out", copy});
  ASSERT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(read_file(copy), kSensor);
  EXPECT_TRUE(std::filesystem::exists(temporary_ / "other" / "measured" / "camera.yaml"));
  EXPECT_FALSE(std::filesystem::exists(temporary_ / "measured"));
}

TEST_F(CalibrateCameraCommand, LeavesTheFileAloneWhenItRefuses) {
  const std::filesystem::path file = sensor_file();
  std::filesystem::create_directory(temporary_ / "few");
  for (const char* name : {"100.png", "101.png", "102.png", "103.png"})
    std::filesystem::copy(pictures() / name, temporary_ / "few" / name);
  expect_refused(calibrate({"--images", temporary_ / "few", "--sensor", file}),
                 {"4 pictures usable: 100.png to 103.png\n", "only 4"});
  expect_refused(calibrate({"--source", "sim", "--sensor", file}), {"sim", "no board"});
  expect_refused(calibrate({"--sensor", file}), {"--source", "--images"});
  expect_refused(calibrate({"--images", pictures()}), {"--sensor", "--out"});
  expect_refused(calibrate({"--images", pictures(), "--sensor", file, "--seconds", "nan"}),
                 {"--seconds", "'nan'", "1 to 1e6"});
  expect_refused(calibrate({"--images", pictures(), "--sensor", file, "--out",
                            temporary_ / "none" / "s.yaml"}),
                 {"none", "cannot be written"});
  expect_refused(calibrate({"--images", pictures(), "--sensor", file, "--out", "/dev/null"}),
                 {"/dev/null", "regular file"});
  expect_refused(calibrate({"--images", pictures(), "--out", file}),
                 {file.string(), "is there already", "--sensor"});
  write_file(temporary_ / "mine.yaml", "# other words");
  expect_refused(
      calibrate({"--images", pictures(), "--sensor", file, "--out", temporary_ / "mine.yaml"}),
      {"mine.yaml: is there already and says something else"});
  expect_refused(
      calibrate({"--images", pictures(), "--sensor", file, "--out", temporary_ / "beside.yaml"}),
      {"beside.yaml: the folder measured/ beside it is that of", "another folder"});
  EXPECT_EQ(read_file(file), kSensor);
  EXPECT_FALSE(std::filesystem::exists(temporary_ / "measured"));
}

TEST_F(CalibrateCameraCommand, NamesAndLeavesOutPicturesThatAreNoneOfTheBoard) {
  const std::filesystem::path folder = temporary_ / "mixed";
  std::filesystem::copy(pictures(), folder);
  cv::imwrite((folder / "099.png").string(), cv::Mat::zeros(240, 320, CV_8UC1));
  cv::imwrite((folder / "grey.png").string(), cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)));
  write_file(folder / "text.png", "no picture");
  const std::string whole = read_file(folder / "105.png");
  write_file(folder / "cut.png", whole.substr(0, whole.size() / 2));
  const Outcome o = calibrate({"--images", folder, "--sensor", sensor_file()});
  ASSERT_EQ(o.status, 0) << o.err;
  for (const char* part :
       {"1 picture of another size: 099.png (320x240)\n", "1 picture without the board: grey.png\n",
        "2 pictures damaged: cut.png, text.png\n", "14 pictures used: 100.png ("})
    EXPECT_NE(o.err.find(part), std::string::npos) << "no '" << part << "' in: " << o.err;
}

TEST_F(CalibrateCameraCommand, RefusesPicturesOfAnotherSize) {
  std::string other = kSensor;
  other.replace(other.find("width: 640"), 10, "width: 800");
  expect_refused(calibrate({"--images", pictures(), "--sensor", sensor_file(other)}),
                 {"640x480", "800x480"});
  std::filesystem::create_directory(temporary_ / "small");
  cv::imwrite((temporary_ / "small" / "0.png").string(), cv::Mat::zeros(240, 320, CV_8UC1));
  expect_refused(
      calibrate({"--images", pictures(), temporary_ / "small", "--sensor", sensor_file()}),
      {"small", "320x240", "640x480"});
  EXPECT_EQ(read_file(temporary_ / "sensor.yaml"), kSensor);
}

TEST_F(CalibrateCameraCommand, CtrlCWritesNothing) {
  const std::filesystem::path file = sensor_file();
  Bridge bridge(
      {"calibrate", "camera", "--board", kBoard, "--images", pictures(), "--sensor", file});
  bridge.signal(SIGINT);
  const Outcome o = bridge.finish();
  // Before the program has taken charge of signals, Ctrl-C ends it the ordinary way.
  EXPECT_TRUE(o.status == 1 || o.status == 128 + SIGINT) << o.status << o.err;
  EXPECT_EQ(read_file(file), kSensor);
  EXPECT_FALSE(std::filesystem::exists(camera_));
}

}  // namespace
}  // namespace tagwrench::test
