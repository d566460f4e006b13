// What the tracker says about a sensor on which nothing is misconfigured: nothing, or what is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench::test {
namespace {

struct Said {
  Track track;
  double seconds = 0;
  double most_visible = 0;  ///< of the tag that was best to see in the second before
};

/// All diagnostics but the one that the rest pose is learned.
std::vector<Said> listen(const sim::Scenario& scenario, int frames, const CameraModel* camera,
                         int* doubted = nullptr) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(camera != nullptr ? *camera : sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);
  std::vector<Said> said;
  std::vector<double> visible;
  int ok = 0, doubtful = 0;
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    source.read(frame);
    const Track track = tracker.track(frame);
    ok += track.status == Status::ok ? 1 : 0;
    doubtful += track.status == Status::doubtful ? 1 : 0;
    const sim::Truth& truth = source.truth();
    visible.push_back(*std::max_element(truth.visible.begin(), truth.visible.end()));
    if (track.diagnostic == Diagnostic::none || track.diagnostic == Diagnostic::rest_learned)
      continue;
    const auto recent = visible.end() - std::min<std::ptrdiff_t>(25, std::ssize(visible));
    said.push_back({track, std::chrono::duration<double>(truth.time).count(),
                    *std::max_element(recent, visible.end())});
    std::printf("%.2f s: hint %d, best visible %.2f\n", said.back().seconds,
                static_cast<int>(track.diagnostic), said.back().most_visible);
  }
  std::printf("%d frames, %d ok, %d doubtful, %zu hints\n", frames, ok, doubtful, said.size());
  if (doubted != nullptr) *doubted = doubtful;
  return said;
}

std::vector<Said> listen(const std::string& name, int frames) {
  return listen(load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/" + name + ".yaml"), frames,
                nullptr);
}

TEST(DiagnosisScenario, NothingIsSaidOfASensorThatIsWell) {
  for (const char* name : {"clean", "realistic", "apriltag", "one_tag", "tap", "drop"}) {
    SCOPED_TRACE(name);
    std::printf("%s: ", name);
    EXPECT_TRUE(listen(name, 200).empty());
  }
}

TEST(DiagnosisScenario, InTroubleOnlyWhatIsTrueIsSaid) {
  for (const Said& said : listen("hard", 1500)) {
    const Diagnostic diagnostic = said.track.diagnostic;
    const bool of_the_picture =
        diagnostic == Diagnostic::no_tag || diagnostic == Diagnostic::image_empty ||
        diagnostic == Diagnostic::image_unsharp || diagnostic == Diagnostic::image_saturated ||
        diagnostic == Diagnostic::image_black;
    const bool true_of_it =
        of_the_picture ? said.most_visible < 0.9 : diagnostic == Diagnostic::tag_missing;
    EXPECT_TRUE(true_of_it) << "hint " << static_cast<int>(diagnostic) << " at " << said.seconds
                            << " s";
  }
}

int shutter_diagnostics(const std::vector<Said>& said) {
  return static_cast<int>(std::count_if(said.begin(), said.end(), [](const Said& s) {
    return s.track.diagnostic == Diagnostic::shutter_rolls;
  }));
}

TEST(DiagnosisScenario, ARollingShutterThatIsNotDescribedIsNoticedOnce) {
  for (const double readout : {12e-3, 20e-3, 30e-3}) {
    sim::Scenario scenario =
        load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/rolling_shutter.yaml");
    scenario.exposure.rolling_readout = readout;
    CameraModel camera = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor").camera;
    camera.readout = 0;
    EXPECT_EQ(shutter_diagnostics(listen(scenario, 250, &camera)), 1) << readout;
  }
}

TEST(DiagnosisScenario, ARollingShutterIsNoticedOnBadPaperInBadLightToo) {
  const std::vector<Said> said = listen("harsh", 250);
  EXPECT_EQ(said.size(), 1U);
  EXPECT_EQ(shutter_diagnostics(said), 1);
}

TEST(DiagnosisScenario, BlurOfMotionIsNotTakenForARollingShutter) {
  sim::Scenario scenario =
      load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/rolling_shutter.yaml");
  scenario.exposure.rolling_readout = 0;
  scenario.exposure.time = 30e-3;
  scenario.trajectory.bandwidth = 4;
  int doubted = 0;
  EXPECT_TRUE(listen(scenario, 250, nullptr, &doubted).empty());
  EXPECT_GT(doubted, 30);
}

}  // namespace
}  // namespace tagwrench::test
