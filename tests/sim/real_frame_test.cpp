// The one real frame of the real sensor, 60 times: tracked when sensor.yaml says that the camera
// mirrors, explained when not.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class RealFrame : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TAGWRENCH_DATA");
    if (data == nullptr)
      GTEST_SKIP() << "TAGWRENCH_DATA is not set; it names the folder with the real recordings";
    const std::filesystem::path frame =
        std::filesystem::path(data) / "icra2020" / "2019-09-13_120207_first_frame_640x480.jpg";
    ASSERT_TRUE(std::filesystem::exists(frame)) << frame;
    for (int i = 0; i < 60; ++i) {
      char name[16];
      std::snprintf(name, sizeof name, "%06d.jpg", i);
      std::filesystem::copy_file(frame, folder_ / name);
    }
  }
  Outcome track(const char* mirrored) {
    write_file(folder_ / "sensor.yaml",
               std::string("camera: {width: 640, height: 480, fx: 805, fy: 805, cx: 319.5, cy: "
                           "239.5, mirrored: ") +
                   mirrored +
                   "}\n"
                   "target: {family: aruco_original, tag_size_mm: 3.8, border_mm: 0.35, tags: "
                   "[{id: 5}, {id: 2}]}\n"
                   "wrench: {springs: {centres_mm: [[11, 7, -11], [-11, 7, -11], [11, -7, -11], "
                   "[-11, -7, -11]],\n"
                   "                   axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07}}\n");
    return run_bridge({"run", "--source", "images:" + folder_.path(), "--sensor",
                       folder_ / "sensor.yaml", "--output", "jsonl:-", "--fast"});
  }

  TemporaryFolder folder_;
};

TEST_F(RealFrame, IsTrackedAsMirroredWithBothTags) {
  const Outcome o = track("true");
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(o.err.find("mirrored"), std::string::npos) << o.err;
  ASSERT_EQ(lines_in(o.out), 60u);
  std::istringstream lines(o.out);
  int number = 0;
  for (std::string line; std::getline(lines, line); ++number) {
    if (number < 25) continue;
    const nlohmann::json s = nlohmann::json::parse(line);
    EXPECT_EQ(s["status"], "ok") << line;
    // The same picture again and again: the displacement is zero but for what rest learning rounds.
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(s["d_m"][a].get<double>(), 0, 20e-6) << line;
  }
}

TEST_F(RealFrame, SaidToBeUnmirroredIsExplainedWithTheRemedy) {
  const Outcome o = track("false");
  EXPECT_EQ(o.status, 0) << o.err;
  EXPECT_NE(o.err.find("mirrored: true"), std::string::npos) << o.err;
  EXPECT_EQ(o.out.find("\"ok\""), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test
