// One number of a sensor's file, changed: everything that is made of it follows.
#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <utility>

#include "tests/hardware/drawn_sensor.h"

namespace tagwrench::test {
namespace {

/// A sensor, exported without its pictures.
struct Exported {
  Exported(const std::string& sensor, const std::string& into) : folder(into) {
    outcome = run_tool({TAGWRENCH_HARDWARE "/export.py", "--program", TAGWRENCH_PROGRAM,
                        "--no-pictures", sensor, folder});
  }
  std::string number(const std::string& name) const {
    std::smatch found;
    const std::string text = read_file(folder / "parameters.scad");
    std::regex_search(text, found, std::regex("\n" + name + " = (.*);"));
    return found[1].str();
  }
  Eigen::Vector3d size(const std::string& part) const {
    return box(read_stl(folder / (part + ".stl"))).sizes();
  }

  std::filesystem::path folder;
  Outcome outcome;
};

/// What a picture of the simulated sensor at rest shows.
struct Seen {
  double edge_px = 0;     ///< along x, mean
  double between_px = 0;  ///< the middles of the two tags
};

Seen rendered(const Exported& sensor, const std::filesystem::path& into) {
  const Outcome sim = run_bridge(
      {"sim", "--scenario", sensor.folder / "scenario.yaml", "--out", into, "--frames", "1"});
  EXPECT_EQ(sim.status, 0) << sim.err;
  cv::Mat picture = cv::imread((into / "000000.png").string(), cv::IMREAD_GRAYSCALE), turned;
  cv::flip(picture, turned, 1);  // this camera mirrors
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
  cv::aruco::detectMarkers(
      turned, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL), corners, ids);
  Seen out;
  if (ids.size() != 2) return out;
  std::vector<cv::Point2f> middles;
  for (const auto& c : corners) {
    out.edge_px += (cv::norm(c[1] - c[0]) + cv::norm(c[2] - c[3])) / 4;
    middles.push_back((c[0] + c[1] + c[2] + c[3]) / 4);
  }
  out.between_px = cv::norm(middles[0] - middles[1]);
  return out;
}

/// The design table's z step by the bound, mm.
double step_in_z(const std::string& sensor) {
  const Outcome design = run_bridge({"design", "--hardware", sensor});
  std::smatch found;
  EXPECT_TRUE(std::regex_search(design.out, found,
                                std::regex("\n  z +[0-9]+ bits +[0-9.]+ mm +([0-9.]+) mm")));
  return found.empty() ? 0 : std::stod(found[1].str());
}

TEST(ParameterFlow, ALensDistanceReachesDrawingPartsSimulatorAndDesign) {
  if (const std::string missing = missing_tool({"openscad", "prusa-slicer"}); !missing.empty())
    GTEST_SKIP() << missing;
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "sensors");
  std::filesystem::create_directory_symlink(TAGWRENCH_HARDWARE "/cameras", folder / "cameras");
  const std::string paper = TAGWRENCH_HARDWARE "/sensors/paper.yaml",
                    far = folder / "sensors" / "far.yaml";
  const std::string text = read_file(paper);
  write_file(far,
             std::regex_replace(text, std::regex("lens_distance_mm: 21"), "lens_distance_mm: 25"));
  ASSERT_NE(read_file(far), text);

  const Exported near(paper, folder / "near"), farther(far, folder / "far");
  ASSERT_EQ(near.outcome.status, 0) << near.outcome.err;
  ASSERT_EQ(farther.outcome.status, 0) << farther.outcome.err;

  // 4 mm more between lens and tags: the drawing,
  EXPECT_EQ(near.number("target_lens_distance"), "21");
  EXPECT_EQ(farther.number("target_lens_distance"), "25");
  EXPECT_NEAR(std::stod(farther.number("z_platform")) - std::stod(near.number("z_platform")), 4,
              1e-6);
  EXPECT_EQ(farther.number("tags"), near.number("tags")) << "in the platform's frame";
  // what the program is told of the sensor,
  for (const auto& [sensor, distance] : {std::pair{&near, "21"}, std::pair{&farther, "25"}}) {
    const std::string told = read_file(sensor->folder / "sensor.yaml");
    EXPECT_TRUE(told.starts_with("# The sensor as drawn, " + std::string(distance) +
                                 " mm from lens to tags: "))
        << told.substr(0, told.find('\n'));
  }
  // the parts: cover and shield are longer, what holds springs and camera stays,
  for (const char* part : {"camera_cover", "light_shield"}) {
    EXPECT_NEAR(farther.size(part).z() - near.size(part).z(), 4, 0.01) << part;
    EXPECT_NEAR(farther.size(part).y(), near.size(part).y(), 0.01) << part;
  }
  for (const char* part : {"mounting_plate", "top_plate"})
    EXPECT_LT((farther.size(part) - near.size(part)).norm(), 0.01) << part;
  // the picture that the simulator renders: all is smaller by 21/25, within what blur leaves,
  const Seen before = rendered(near, folder / "near-frames");
  const Seen after = rendered(farther, folder / "far-frames");
  constexpr double kFocal_px = 805, kTag_mm = 3.8;
  EXPECT_NEAR(before.edge_px, kFocal_px * kTag_mm / 21, 1.5);
  EXPECT_NEAR(after.edge_px, kFocal_px * kTag_mm / 25, 1.5);
  EXPECT_NEAR(after.between_px / before.between_px, 21.0 / 25, 0.01);
  // the program with the sensor.yaml of either finds it where it is and gives newtons,
  for (const Exported* sensor : {&near, &farther}) {
    const Outcome run = run_bridge(
        {"run", "--source", "sim:" + (sensor->folder / "scenario.yaml").string(), "--sensor",
         sensor->folder / "sensor.yaml", "--output", "jsonl:-", "--fast", "--frames", "40"});
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.out.find("\"status\":\"ok\""), std::string::npos) << run.err;
  }
  // and the design: depth is seen by the growth of the picture, hence by the square of the
  // distance.
  EXPECT_NEAR(step_in_z(far) / step_in_z(paper), 25.0 * 25 / (21 * 21), 0.15);
}

}  // namespace
}  // namespace tagwrench::test
