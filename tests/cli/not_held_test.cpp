// A run that holds no target says why, once while it runs and again in its last line.
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

constexpr int kFrames = 50;  // 2 s

class NotHeld : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome sim = run_bridge({"sim", "--out", folder(), "--frames", std::to_string(kFrames)});
    ASSERT_EQ(sim.status, 0) << sim.err;
  }
  std::string folder() const { return (temporary_ / "frames").string(); }

  void repaint(const std::function<void(cv::Mat&)>& change) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder())) {
      if (entry.path().extension() != ".png") continue;
      cv::Mat picture = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
      change(picture);
      ASSERT_TRUE(cv::imwrite(entry.path().string(), picture));
    }
  }
  void edit_sensor(const std::string& from, const std::string& to) const {
    const std::filesystem::path file = temporary_ / "frames/sensor.yaml";
    std::string text = read_file(file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " is not in\n" << text;
    write_file(file, text.replace(at, from.size(), to));
  }
  void expect_said(const std::vector<std::string>& parts) const {
    const Outcome run =
        run_bridge({"run", "--source", "images:" + folder(), "--sensor", folder() + "/sensor.yaml",
                    "--output", "jsonl:" + (temporary_ / "out.jsonl").string(), "--fast"});
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(lines_in(run.err), 7U) << "source, what is in force, cause, summary: " << run.err;
    const std::size_t cause = run.err.find('\n', run.err.find("zero: none is set")) + 1;
    const std::size_t summary = run.err.find('\n', cause) + 1;
    for (const std::string& part : parts) {
      EXPECT_LT(run.err.find(part, cause), summary) << "no '" << part << "' in: " << run.err;
      EXPECT_NE(run.err.find(part, summary), std::string::npos) << run.err;
    }
  }

  TemporaryFolder temporary_;
};

TEST_F(NotHeld, LensCap) {
  repaint([](cv::Mat& picture) { picture.setTo(5); });
  expect_said({"black", "lens cap"});
}

TEST_F(NotHeld, WrongIds) {
  edit_sensor("{id: 2}", "{id: 9}");
  expect_said({"tags 5 and 2 are seen", "sensor.yaml has tags 5 and 9", "target.tags"});
}

TEST_F(NotHeld, OneOfTwoTags) {
  repaint([](cv::Mat& picture) { picture.rowRange(260, picture.rows).setTo(90); });
  expect_said({"tag 5 is seen, tag 2 is not"});
}

}  // namespace
}  // namespace tagwrench::test
