// `tagwrench doctor --focus` as its users run it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <regex>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class DoctorFocus : public testing::Test {
 protected:
  std::string scenario(const std::string& text) {
    const std::string file = temporary_ / "scenario.yaml";
    write_file(file, "trajectory: {motion: rest}\n" + text);
    return "sim:" + file;
  }
  static Outcome focus(const std::string& source, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"doctor", "--focus", "--source", source, "--seconds", "0.3"});
    return run_bridge(more);
  }
  /// Of the first line; empty tags are left out.
  static std::vector<double> widths(const std::string& out) {
    static const std::regex edges("edges +([0-9.]+) px wide");
    const std::string line = out.substr(0, out.find('\n'));
    std::vector<double> found;
    for (std::sregex_iterator it(line.begin(), line.end(), edges), end; it != end; ++it)
      found.push_back(std::stod((*it)[1]));
    return found;
  }
  /// A folder with one frame of the simulated sensor, blurred once more; without its sensor.yaml.
  std::string blurred_frames(double blur_px) {
    const std::string folder = temporary_ / "frames";
    EXPECT_EQ(run_bridge({"sim", "--out", folder, "--frames", "1"}).status, 0);
    const std::string file = folder + "/000000.png";
    cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
    cv::GaussianBlur(image, image, {}, blur_px);
    cv::imwrite(file, image);
    std::filesystem::remove(folder + "/sensor.yaml");
    return "images:" + folder;
  }

  TemporaryFolder temporary_;
};

TEST_F(DoctorFocus, WidthIsThatOfTheLens) {
  double before = 0;
  for (const double focus_mm : {20.0, 17.5, 15.0, 13.5}) {
    const Outcome outcome =
        focus(scenario("optics: {psf_sigma_px: 0.9, defocus_px_per_mm: 0.45, focus_mm: " +
                       std::to_string(focus_mm) + "}\n"));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::vector<double> found = widths(outcome.out);
    ASSERT_EQ(found.size(), 2u) << outcome.out;
    const double lens = std::hypot(0.9, 0.45 * (21 - focus_mm));  // px
    for (const double width : found) EXPECT_NEAR(width / lens, 1, 0.2) << outcome.out;
    const double mean = 0.5 * (found[0] + found[1]);
    EXPECT_GT(mean, before);
    before = mean;
  }
}

TEST_F(DoctorFocus, NeedsNoCalibration) {
  const std::string other =
      "camera: {width: 800, height: 600, fx: 950, fy: 950, cx: 420, cy: 290, mirrored: true}\n"
      "optics: {psf_sigma_px: 1.5, defocus_px_per_mm: 0}\n";
  const std::string folder = temporary_ / "frames";
  ASSERT_EQ(
      run_bridge({"sim", "--scenario", scenario(other).substr(4), "--out", folder, "--frames", "1"})
          .status,
      0);
  std::filesystem::remove(folder + "/sensor.yaml");
  const Outcome outcome = focus("images:" + folder);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::vector<double> found = widths(outcome.out);
  ASSERT_EQ(found.size(), 2u) << outcome.out;
  for (const double width : found) EXPECT_NEAR(width / 1.5, 1, 0.2);
}

TEST_F(DoctorFocus, ReadsTheRealFrame) {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (!data) GTEST_SKIP() << "TAGWRENCH_DATA is not set";
  const std::filesystem::path frame =
      std::filesystem::path(data) / "icra2020" / "2019-09-13_120207_first_frame_640x480.jpg";
  const std::string folder = temporary_ / "frames";
  std::filesystem::create_directories(folder);
  std::filesystem::copy(frame, folder + "/000000.jpg");
  const Outcome outcome = focus("images:" + folder);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::vector<double> found = widths(outcome.out);
  ASSERT_EQ(found.size(), 2u) << outcome.out;
  for (const double width : found) EXPECT_NEAR(width, 1.9, 0.4) << outcome.out;  // by eye: 1.5 to 2
}

TEST_F(DoctorFocus, SaysWhenItCannotTellBetter) {
  const std::string out = focus(scenario("optics: {psf_sigma_px: 0, defocus_px_per_mm: 0}\n")).out;
  EXPECT_NE(out.find("edges 0.2 px wide or less, the least that can be measured"),
            std::string::npos)
      << out;
  EXPECT_NE(out.find("as sharp as can be measured: leave it, and lock the lens"), std::string::npos)
      << out;
}

/// One frame of the simulated sensor after an unsharp mask.
TEST_F(DoctorFocus, IsOfTheLensWhereTheCameraSharpens) {
  const std::string folder = temporary_ / "frames";
  ASSERT_EQ(run_bridge({"sim", "--scenario",
                        scenario("optics: {psf_sigma_px: 1.2, defocus_px_per_mm: 0}\n").substr(4),
                        "--out", folder, "--frames", "1"})
                .status,
            0);
  const std::string file = folder + "/000000.png";
  const cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
  cv::Mat soft;
  cv::GaussianBlur(image, soft, {}, 1);
  cv::imwrite(file, 2.5 * image - 1.5 * soft);
  const Outcome outcome = focus("images:" + folder);
  const std::vector<double> found = widths(outcome.out);
  ASSERT_EQ(found.size(), 2u) << outcome.out;
  for (const double width : found) EXPECT_NEAR(width / 1.2, 1, 0.2) << outcome.out;
  EXPECT_NE(outcome.out.find("sharpened by the camera"), std::string::npos) << outcome.out;
}

TEST_F(DoctorFocus, SaysWhatIsSeenWhereTagsCannotBeRead) {
  const Outcome soft = focus(blurred_frames(9));
  EXPECT_EQ(soft.status, 1);
  EXPECT_NE(soft.out.find("tag 5    not seen"), std::string::npos) << soft.out;
  std::smatch width;
  ASSERT_TRUE(std::regex_search(soft.out, width, std::regex("are about ([0-9]+) px wide")))
      << soft.out;
  EXPECT_NEAR(std::stod(width[1]), 9, 3);
  EXPECT_NE(soft.err.find("never seen"), std::string::npos) << soft.err;
  EXPECT_NE(focus(blurred_frames(60)).out.find("no edges at all"), std::string::npos);
}

TEST_F(DoctorFocus, SaysWhenOtherTagsAreSeen) {
  const std::string folder = temporary_ / "frames";
  ASSERT_EQ(run_bridge({"sim", "--out", folder, "--frames", "1"}).status, 0);
  const std::string sensor = folder + "/sensor.yaml";
  const std::string text = read_file(sensor);
  write_file(sensor, std::regex_replace(std::regex_replace(text, std::regex("id: 5"), "id: 7"),
                                        std::regex("id: 2"), "id: 8"));
  const Outcome outcome = focus("images:" + folder);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_TRUE(std::regex_search(outcome.out, std::regex("a tag is seen, but with id [25]")))
      << outcome.out;
}

TEST_F(DoctorFocus, SaysWhenTheLightIsWrong) {
  const std::string sharp = "optics: {psf_sigma_px: 1}\n";
  const auto said = [&](const std::string& light) { return focus(scenario(sharp + light)).out; };
  EXPECT_NE(said("light: {level_counts: 400}\n").find("less light"), std::string::npos);
  EXPECT_NE(said("light: {level_counts: 40, glare_counts: 0}\n").find("more light"),
            std::string::npos);
  EXPECT_EQ(said("light: {level_counts: 200, glare_counts: 0}\n").find(" light"),
            std::string::npos);
}

TEST_F(DoctorFocus, GoesOnUntilItIsStopped) {
  Bridge program({"doctor", "--focus", "--source", "sim"});
  ASSERT_TRUE(program.wait_for_lines(3));
  program.signal(SIGINT);
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.out.find("sharpest so far"), std::string::npos) << outcome.out;
}

TEST_F(DoctorFocus, WithoutFocusItSaysWhatIsInForceForASensor) {
  const std::string folder = temporary_ / "sensor";
  ASSERT_EQ(run_bridge({"sim", "--out", folder, "--frames", "1"}).status, 0);
  const std::string sensor = folder + "/sensor.yaml";
  std::string out = run_bridge({"doctor", "--sensor", sensor}).out;
  for (const char* line : {"ok  camera: sensor.yaml\n", "ok  target: sensor.yaml; its rest",
                           "ok  wrench: sensor.yaml's springs\n", "ok  zero: none is set\n"})
    EXPECT_NE(out.find(line), std::string::npos) << line << out;
  std::filesystem::create_directory(folder + "/measured");
  write_file(
      folder + "/measured/camera.yaml",
      "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
      "camera_matrix: {rows: 3, cols: 3, data: [800., 0., 320., 0., 800., 240., 0., 0., 1.]}\n"
      "distortion_coefficients: {rows: 1, cols: 5, data: [0., 0., 0., 0., 0.]}\n"
      "tagwrench: {date: 2026-05-02}\n");
  out = run_bridge({"doctor", "--sensor", sensor}).out;
  EXPECT_NE(out.find("ok  camera: measured/camera.yaml, of 2026-05-02\n"), std::string::npos)
      << out;
  write_file(folder + "/measured/camera.yaml", "image_width: wide\n");
  out = run_bridge({"doctor", "--sensor", sensor}).out;
  EXPECT_NE(out.find("!!  " + folder + "/measured/camera.yaml:1: image_width"), std::string::npos)
      << out;
}

TEST_F(DoctorFocus, WrongUseIsRefusedInOneLine) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"doctor", "--source", "sim"},
           {"doctor", "--focus", "--source", "radio"},
           {"doctor", "--focus", "--source", "sim", "--sensor", temporary_ / "none.yaml"},
           {"doctor", "--focus", "--source", "sim", "--seconds", "0"}}) {
    const Outcome outcome = run_bridge(arguments);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
}

}  // namespace
}  // namespace tagwrench::test
