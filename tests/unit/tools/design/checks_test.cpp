#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "host/tools/design/geometry.h"
#include "tests/unit/tools/design/published.h"

namespace tagwrench::hardware {
namespace {

std::vector<Complaint> complaints_of(const Parameters& p) { return complaints(p, geometry(p)); }

/// One parameter of a shipped variant, made wrong, and the one that the complaint names.
struct Wrong {
  const char* name;
  const char* variant;
  std::function<void(Parameters&)> spoil;
  const char* parameter;
  const char* remedy;  ///< part of the message
};

void PrintTo(const Wrong& wrong, std::ostream* out) { *out << wrong.name; }

class WrongParameter : public testing::TestWithParam<Wrong> {};

TEST_P(WrongParameter, IsNamedInOneLineWithARemedy) {
  Parameters p = published(GetParam().variant);
  ASSERT_TRUE(complaints_of(p).empty()) << complaints_of(p).front().message;
  GetParam().spoil(p);
  const auto found = complaints_of(p);
  const auto named = std::find_if(found.begin(), found.end(), [](const Complaint& c) {
    return c.parameter == GetParam().parameter &&
           c.message.find(GetParam().remedy) != std::string::npos;
  });
  std::string all;
  for (const Complaint& c : found) all += c.parameter + ": " + c.message + "\n";
  ASSERT_NE(named, found.end()) << "found only:\n" << all;
  EXPECT_EQ(named->message.find('\n'), std::string::npos);
  EXPECT_EQ(named->message.find("nan"), std::string::npos);
}

const Wrong kWrong[] = {
    {"ThinShield", "paper", [](Parameters& p) { p.printing.wall = 0.7e-3; }, "print.wall_mm",
     "take 0.80 mm"},
    {"WideNozzle", "paper", [](Parameters& p) { p.printing.nozzle = 1.0e-3; }, "print.wall_mm",
     "nozzle"},
    {"ThinCover", "paper", [](Parameters& p) { p.cover.wall = 0.6e-3; }, "cover.wall_mm",
     "take 0.80 mm"},
    {"ThinPlate", "paper", [](Parameters& p) { p.top.plate = 2.4e-3; }, "top.plate_mm", "or more"},
    {"ThinDiffuser", "paper", [](Parameters& p) { p.light.diffuser = 0.1e-3; }, "light.diffuser_mm",
     "layer"},
    {"ThinRoof", "paper", [](Parameters& p) { p.top.roof = 1.2e-3; }, "top.roof_mm", "take 1.4 mm"},
    {"SpringsTooFarApartAlong", "paper", [](Parameters& p) { p.springs.spacing_x = 24e-3; },
     "springs.spacing_mm", "widen cover.x_mm"},
    {"SpringsTooFarApartAcross", "paper", [](Parameters& p) { p.springs.spacing_y = 18e-3; },
     "springs.spacing_mm", "widen cover.y_mm"},
    {"SpringsInTheLens", "paper", [](Parameters& p) { p.springs.spacing_x = 12e-3; },
     "springs.spacing_mm", "lens holder"},
    {"LightInTheLens", "paper", [](Parameters& p) { p.light.x = 9e-3; }, "light.position_mm",
     "move it out"},
    {"LightInTheWall", "paper", [](Parameters& p) { p.light.x = 16e-3; }, "light.position_mm",
     "move it in"},
    {"TallLight", "paper", [](Parameters& p) { p.light.height = 14e-3; }, "light.height_mm",
     "flatter LED"},
    {"WallsBeforeStops", "paper", [](Parameters& p) { p.stops.gap = 2.0e-3; }, "stops.gap_mm",
     "or more"},
    {"NoRoomForStops", "paper", [](Parameters& p) { p.stops.z = 2.5e-3; }, "stops.z_mm",
     "less travel"},
    {"StopAtTheBackInTheLens", "paper",
     [](Parameters& p) { p.stops.x = 3.5e-3, p.stops.gap = 3.5e-3; }, "stops.x_mm", "longer cover"},
    {"StopsAtTheSidesInTheLens", "paper",
     [](Parameters& p) { p.stops.y = p.stops.gap = 4e-3, p.cover.x_to = 15.5e-3; }, "stops.y_mm",
     "wider cover"},
    {"NoThreadForStops", "paper", [](Parameters& p) { p.stops.thread_hole = 3.2e-3; },
     "stops.thread_hole_mm", "2.6"},
    {"NoThreadInPlate", "paper", [](Parameters& p) { p.top.thread_hole = 2.0e-3; },
     "top.thread_hole_mm", "1.7"},
    {"NoThreadInCover", "paper", [](Parameters& p) { p.cover.thread_hole = 2.4e-3; },
     "cover.thread_hole_mm", "take about"},
    {"LowLedge", "paper", [](Parameters& p) { p.cover.ledge = 4.0e-3; }, "cover.ledge_mm",
     "or more"},
    {"ShortCover", "paper", [](Parameters& p) { p.cover.x_from = -9.0e-3; }, "cover.x_mm",
     "longer"},
    {"LongBoltsNeeded", "paper", [](Parameters& p) { p.mount.thickness = 4.2e-3; },
     "cover.ledge_mm", "thread"},
    {"HolesInTheLens", "paper", [](Parameters& p) { p.camera.lens_diameter = 31e-3; }, "camera",
     "hole_spacing_mm"},
    {"ShortEars", "paper", [](Parameters& p) { p.mount.width = 32e-3; }, "mount.width_mm",
     "take 38 mm"},
    {"SolidSprings", "paper", [](Parameters& p) { p.springs.wire = 0.71e-3; }, "springs.wire_mm",
     "check the spring's numbers"},
    {"SpringsCloseBeforeStops", "gripper40", [](Parameters& p) { p.springs.axial = 9e3; },
     "stops.z_mm", "longer springs"},
    {"SpringsBuckle", "paper", [](Parameters& p) { p.springs.outer_diameter = 3.3e-3; },
     "springs.free_length_mm", "sideways"},
    {"TooNearToFocus", "paper", [](Parameters& p) { p.camera.nearest_focus = 22e-3; },
     "target.lens_distance_mm", "focuses"},
    {"SmallTags", "paper", [](Parameters& p) { p.target.tag_size = 1.4e-3; }, "target.tag_size_mm",
     "larger tags"},
    {"TagsTouchLens", "paper", [](Parameters& p) { p.target.lens_distance = 3.5e-3; },
     "target.lens_distance_mm", "from the lens"},
    {"TagsOutsideThePicture", "paper", [](Parameters& p) { p.target.tag_size = 4.4e-3; },
     "target.lens_distance_mm", "leaves the picture"},
    {"SpringBeforeTag", "endoscope",
     [](Parameters& p) {
       p.springs.spacing_x = p.springs.spacing_y = 8e-3, p.camera.lens_diameter = 4e-3;
     },
     "springs.spacing_mm", "hides a tag"},
    {"LensTooDeep", "endoscope", [](Parameters& p) { p.springs.free_length = 18e-3; },
     "camera.lens_diameter_mm", "too deep"},
    {"NarrowKnob", "puck", [](Parameters& p) { p.top.knob_diameter = 48e-3; }, "top.knob_mm",
     "or more"},
    {"NarrowBase", "puck", [](Parameters& p) { p.mount.width = 76e-3; }, "mount.width_mm",
     "or more"},
    {"LowBase", "puck", [](Parameters& p) { p.mount.bay_height = 10e-3; }, "mount.bay_height_mm",
     "13 mm"},
    {"HeavyBase", "puck", [](Parameters& p) { p.mount.weight = 0.4; }, "mount.weight_g",
     "take less"},
    {"MirrorBetweenSprings", "mirror", [](Parameters& p) { p.springs.spacing_y = 16e-3; },
     "springs.spacing_mm", "mirror's holder"},
    {"MirrorHidesFlatTag", "mirror", [](Parameters& p) { p.target.ridge_gap = 0.15e-3; },
     "target.ridge_gap_mm", "hides the flat tag"},
    {"MirrorBesideCover", "mirror", [](Parameters& p) { p.cover.x_to = 13e-3; }, "cover.x_mm",
     "mirror's holder"},
};

INSTANTIATE_TEST_SUITE_P(Checks, WrongParameter, testing::ValuesIn(kWrong),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Checks, ShippedVariantsCanBeBuilt) {
  for (const char* name : {"paper", "puck", "gripper40", "single", "mirror", "endoscope"}) {
    const auto found = complaints_of(published(name));
    EXPECT_TRUE(found.empty()) << name << ": " << found.front().message;
  }
}

TEST(Checks, ShortWideSpringsNeverBuckle) {
  // EN 13906-1: with one end free to move sideways, below a slenderness of about 2.6.
  EXPECT_TRUE(std::isinf(buckling_deflection(2.5, 1)));
  EXPECT_FALSE(std::isinf(buckling_deflection(2.8, 1)));
}

TEST(Checks, SlenderSpringsBuckleAtEulersLoad) {
  // So slender that only bending counts: pi^2 E I / l^2 of the helix over its axial stiffness is
  // how far it is shortened then.
  const double length = 100, diameter = 1;
  const double poisson = 0.3;
  const double bending = diameter * diameter * length * (1 + poisson) / (2 * (2 + poisson));
  const double euler = M_PI * M_PI * bending / (length * length);  // axial stiffness of 1
  EXPECT_NEAR(buckling_deflection(length, diameter), euler, 0.01 * euler);
}

}  // namespace
}  // namespace tagwrench::hardware
