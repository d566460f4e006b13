// The design calculator's bound, made of edges alone, beside the bound that the simulator's
// rendered pictures have.
#include <gtest/gtest.h>

#include "host/app/scenario_config.h"
#include "host/source/simulator/mechanics.h"
#include "host/tools/design/design.h"
#include "host/tracker/target.h"
#include "tests/bench/tracker_bound.h"

namespace tagwrench {
namespace {

constexpr double kTolerance = 1.25;  // either way

sim::Scenario clean() { return load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/clean.yaml"); }

std::vector<study::SeenTag> seen_tags(const sim::Scenario& scenario) {
  std::vector<study::SeenTag> tags;
  for (const sim::PlacedTag& placed : sim::placed_tags(scenario)) {
    const TagPattern pattern =
        tag_pattern(family_from_name(scenario.target.family).value(), placed.id,
                    scenario.target.tag_size, scenario.target.border);
    study::SeenTag tag;
    tag.camera_T_tag.linear() = placed.platform_T_tag.rotation;
    tag.camera_T_tag.translation() = scenario.target.rest_position + placed.platform_T_tag.position;
    tag.size = pattern.size;
    tag.border = pattern.border;
    tag.cells = pattern.cells;
    tag.white = pattern.white;
    tags.push_back(tag);
  }
  return tags;
}

Vector6 predicted(const sim::Scenario& scenario) {
  study::SeenPicture picture;
  picture.fx_px = scenario.camera.fx_px;
  picture.fy_px = scenario.camera.fy_px;
  picture.cx_px = scenario.camera.cx_px;
  picture.cy_px = scenario.camera.cy_px;
  picture.blur_px = scenario.optics.psf_sigma_px;
  picture.noise_counts = std::sqrt(std::pow(scenario.noise.read_counts, 2) + 1.0 / 12);
  picture.contrast_counts = scenario.light.level_counts *
                            (scenario.target.paper_reflectance - scenario.target.ink_reflectance);
  return study::displacement_bound(seen_tags(scenario), scenario.target.rest_position, picture)
      .diagonal()
      .cwiseSqrt();
}

void expect_alike(const Vector6& predicted, const Vector6& measured) {
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(predicted[i], measured[i] / kTolerance) << "axis " << i << ", m or rad";
    EXPECT_LT(predicted[i], measured[i] * kTolerance) << "axis " << i << ", m or rad";
  }
}

TEST(DesignBound, IsThatOfRenderedPictures) {
  bench::BoundOfScenario rendered(clean());
  expect_alike(predicted(clean()), rendered.at(Vector6::Zero()).sigma);
}

TEST(DesignBound, FollowsFocalLengthBlurNoiseAndDistance) {
  sim::Scenario other = clean();
  other.camera.fx_px = other.camera.fy_px = 500;
  other.optics.psf_sigma_px = 1.5;
  other.noise.read_counts = 1;
  other.target.rest_position.z() = 18e-3;
  bench::BoundOfScenario rendered(other);
  expect_alike(predicted(other), rendered.at(Vector6::Zero()).sigma);
}

}  // namespace
}  // namespace tagwrench
