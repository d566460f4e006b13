
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/source/simulator/simulator_source.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::sim {
namespace {

namespace fs = std::filesystem;

class FolderExport : public testing::Test {
 protected:
  static Scenario small() {
    Scenario s;
    s.camera.width_px = 160;
    s.camera.height_px = 120;
    s.camera.fx_px = s.camera.fy_px = 201;
    s.camera.cx_px = 79.5;
    s.camera.cy_px = 59.5;
    s.trajectory.rest_time = 0.04;
    return s;
  }
  static std::string content(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::set<std::string> names(const fs::path& dir) const {
    std::set<std::string> found;
    for (const auto& entry : fs::directory_iterator(dir))
      found.insert(entry.path().filename().string());
    return found;
  }

  test::TemporaryFolder temporary_;
  fs::path root_ = temporary_.path();
};

TEST_F(FolderExport, WritesPicturesTimesTruthAndSensor) {
  const fs::path dir = root_ / "new" / "out";
  const Scenario s = small();
  export_folder(s, dir, 3);
  EXPECT_EQ(names(dir), (std::set<std::string>{"000000.png", "000001.png", "000002.png",
                                               "frames.csv", "sensor.yaml", "truth.csv"}));
  EXPECT_EQ(content(dir / "frames.csv"),
            "file,t_ns\n000000.png,0\n000001.png,40000000\n000002.png,80000000\n");

  SimulatorSource source(s, false);
  std::istringstream truth(content(dir / "truth.csv"));
  std::string line;
  std::getline(truth, line);
  EXPECT_EQ(line, "seq,t_ns,dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm");
  for (int i = 0; i < 3; ++i) {
    Frame frame;
    source.read(frame);
    ASSERT_TRUE(std::getline(truth, line));
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    double value = 0;
    fields >> value;
    EXPECT_EQ(value, i);
    fields >> value;
    EXPECT_EQ(value, i * 40e6);
    for (int axis = 0; axis < 12; ++axis) {
      ASSERT_TRUE(fields >> value);
      const double expected =
          axis < 6 ? source.truth().displacement[axis] : source.truth().wrench[axis - 6];
      EXPECT_NEAR(value, expected, 1e-8 * std::abs(expected) + 1e-15);
    }
    // PNG is lossless: the file holds the frame's own bytes.
    const cv::Mat image = cv::imread(
        (dir / (std::string("00000") + std::to_string(i) + ".png")).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(image.type(), CV_8UC1);
    for (int row = 0; row < image.rows; ++row) {
      ASSERT_TRUE(std::equal(image.ptr(row), image.ptr(row) + image.cols,
                             frame.image.pixels + row * frame.image.stride));
    }
  }
}

TEST_F(FolderExport, OtherFormatsOnRequest) {
  Scenario s = small();
  s.compression.file = FileFormat::pgm;
  export_folder(s, root_, 1);
  EXPECT_EQ(names(root_).count("000000.pgm"), 1U);
  s.compression.file = FileFormat::jpeg;
  export_folder(s, root_, 1);
  EXPECT_EQ(names(root_).count("000000.jpg"), 1U);
  EXPECT_EQ(names(root_).count("000000.pgm"), 0U);
}

TEST_F(FolderExport, ReplacesItsOwnEarlierOutput) {
  export_folder(small(), root_, 4);
  export_folder(small(), root_, 2);
  EXPECT_EQ(names(root_).count("000003.png"), 0U);
  EXPECT_EQ(names(root_).size(), 5U);
}

TEST_F(FolderExport, LeavesForeignFilesAlone) {
  std::ofstream(root_ / "thesis.tex") << "years of work";
  try {
    export_folder(small(), root_, 1);
    FAIL() << "wrote into somebody's folder";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("thesis.tex"), std::string::npos);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  EXPECT_EQ(names(root_), std::set<std::string>{"thesis.tex"});
}

TEST_F(FolderExport, NumberedPicturesAloneMayBeAnybodys) {
  std::ofstream(root_ / "000000.png") << "holiday";
  EXPECT_THROW(export_folder(small(), root_, 1), ConfigError);
  EXPECT_EQ(content(root_ / "000000.png"), "holiday");
}

TEST_F(FolderExport, AFailingWriteLeavesNothingBehind) {
  // A file size limit stands in for a full disk.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = before;
  tight.rlim_cur = 1000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  std::string message;
  try {
    export_folder(small(), root_, 2);
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(message.find("cannot be written"), std::string::npos) << message;
  EXPECT_TRUE(names(root_).empty());
}

TEST_F(FolderExport, SensorFileKnowsTheDesignButNotTheGlueing) {
  YamlReader root = YamlReader::from_text(sensor_yaml(Scenario{}), "sensor.yaml");
  YamlReader camera = root.child("camera");
  EXPECT_EQ(camera.integer("width", 1, 10000), 640);
  EXPECT_EQ(camera.positive("fx"), 805.0);
  EXPECT_EQ(camera.numbers("distortion", 5)[0], Scenario{}.camera.distortion[0]);
  YamlReader target = root.child("target");
  EXPECT_EQ(target.text("family"), "aruco_original");
  EXPECT_EQ(target.positive("tag_size_mm"), 3.8);
  for (YamlReader& tag : target.children("tags")) {
    tag.integer("id", 0, 1023);
    EXPECT_NO_THROW(tag.finish());  // no position, no rotation
  }
  YamlReader wrench = root.child("wrench");
  YamlReader springs = wrench.child("springs");
  EXPECT_EQ(springs.positive("axial_n_per_mm"), 0.7);
  EXPECT_EQ(springs.positive("lateral_n_per_mm"), 0.07);
  EXPECT_EQ(wrench.numbers("range_n", 3).size(), 3U);
}

}  // namespace
}  // namespace tagwrench::sim
