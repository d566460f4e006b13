// From a page's request to a command line: names from lists, numbers in their range, never a path.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/web/bridge/job_command.h"

namespace tagwrench {
namespace {

using nlohmann::json;
using Words = std::vector<std::string>;

JobPlace bench_place() {
  return {.sensor = "/tmp/s/sensor.yaml",
          .source = "sim",
          .board = "",
          .cells = "",
          .calibrated = true};
}

std::string refusal_of(const std::string& verb, const json& options, const JobPlace& place) {
  try {
    job_command(verb, options, place);
  } catch (const RequestRefused& e) {
    return e.what();
  }
  return {};
}

TEST(JobCommands, AreOurOwnVerbsWithTheSensorAndSourceOfTheRun) {
  const JobCommand target = job_command("target", {{"seconds", 12}}, bench_place());
  EXPECT_EQ(target.arguments, (Words{"calibrate", "target", "--sensor=/tmp/s/sensor.yaml",
                                     "--source=sim", "--seconds=12"}));
  EXPECT_TRUE(target.needs_camera);
  EXPECT_FALSE(target.takes_keys);
  const JobCommand wrench =
      job_command("wrench", {{"plan", "six_orientations"}, {"resume", true}}, bench_place());
  EXPECT_EQ(wrench.arguments, (Words{"calibrate", "wrench", "--sensor=/tmp/s/sensor.yaml",
                                     "--source=sim", "--plan=six_orientations", "--resume"}));
  EXPECT_TRUE(wrench.takes_keys);
  const JobCommand check =
      job_command("check", {{"mass_g", 50}, {"at", {15, 0, -6.5}}}, bench_place());
  EXPECT_EQ(check.arguments.back(), "--at=15,0,-6.5");
  EXPECT_EQ(job_command("doctor", json::object(), {}).arguments, Words{"doctor"});
  EXPECT_FALSE(job_command("doctor", nullptr, {}).needs_camera);
}

TEST(JobCommands, TakeNothingThatWasNotLookedAt) {
  const JobPlace place = bench_place();
  EXPECT_NE(refusal_of("rm", {}, place), "");
  EXPECT_NE(refusal_of("target", {{"out", "/etc/passwd"}}, place), "");
  EXPECT_NE(refusal_of("target", {{"seconds", 1e9}}, place), "");
  EXPECT_NE(refusal_of("target", {{"seconds", "5; reboot"}}, place), "");
  EXPECT_NE(refusal_of("target", json::array({1}), place), "");
  EXPECT_NE(refusal_of("wrench", {{"plan", "/tmp/plan.yaml"}}, place), "");
  EXPECT_NE(refusal_of("wrench", {{"plan", "paper"}, {"notes", "two\nlines"}}, place), "");
  EXPECT_NE(refusal_of("wrench", {{"plan", "paper"}, {"resume", true}, {"force", true}}, place),
            "");
  EXPECT_NE(refusal_of("check", {{"mass_g", 50}}, place), "");
  EXPECT_NE(refusal_of("check", {{"mass_g", 50}, {"at", {1, 2}}}, place), "");
  EXPECT_NE(refusal_of("check", {{"mass_g", 50}, {"at", {1, 2, "x"}}}, place), "");
  JobPlace camera = place;
  camera.source = "v4l2:/dev/video0";
  camera.source_kind = SourceKind::camera;
  EXPECT_NE(refusal_of("camera", {{"board", "--help"}}, camera), "");
  EXPECT_EQ(refusal_of("camera", {{"board", "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50"}}, camera), "");
}

TEST(JobCommands, SayWhatIsMissing) {
  JobPlace place = bench_place();
  EXPECT_NE(refusal_of("camera", {}, place).find("real camera"), std::string::npos);
  place.calibrated = false;
  EXPECT_NE(refusal_of("certificate", {}, place).find("not calibrated"), std::string::npos);
  place.sensor.clear();
  EXPECT_NE(refusal_of("target", {}, place).find("--sensor FILE"), std::string::npos);
  EXPECT_EQ(possible_jobs(place), Words{"doctor"});
  place = bench_place();
  place.kept = true;
  EXPECT_EQ(possible_jobs(place), (Words{"certificate", "doctor"}));
  place = bench_place();
  place.source = "v4l2:/dev/video0";
  place.source_kind = SourceKind::camera;
  EXPECT_NE(refusal_of("wrench", {{"plan", "load_cell"}}, place).find("--board"),
            std::string::npos);
  place.board = "auto";
  EXPECT_EQ(refusal_of("wrench", {{"plan", "load_cell"}}, place), "");
}

}  // namespace
}  // namespace tagwrench
