// The printed parts of a variant: solid, printable, as large and as heavy as its file says.
#include <algorithm>
#include <cstdlib>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <set>

#include "host/tools/design/geometry.h"
#include "tests/hardware/variant.h"

namespace tagwrench::test {
namespace {

constexpr double kToMm = 1e3;
constexpr double kPrinted_mm = 0.02;  // what an STL of coarse circles may be off
constexpr double kPaper_mm = 0.1;     // between the tag's face and what it is glued on
constexpr double kSteel = 7.85e-3;    // g/mm^3

using VariantParts = Variant;

TEST_F(VariantParts, AreThoseThatTheProgramNames) {
  std::vector<std::string> names;
  for (const DrawnPart& part : sensor().parts) names.push_back(part.name);
  std::vector<std::string> named = hardware::printed_parts(parameters());
  std::sort(names.begin(), names.end());
  std::sort(named.begin(), named.end());
  EXPECT_EQ(names, named);
}

TEST_F(VariantParts, PassTheProgramsOwnCheck) {
  const Outcome check = run_bridge({"design", "--check", yaml()});
  EXPECT_EQ(check.status, 0) << check.out;
}

TEST_F(VariantParts, AreClosedSolidsOfOnePiece) {
  for (const DrawnPart& part : sensor().parts) {
    const std::string stl = folder() + "/" + part.name + ".stl";
    // As the file has it: admesh repairs before it counts again.
    const std::string admesh = run_tool({"admesh", stl}).out;
    EXPECT_TRUE(std::regex_search(admesh, std::regex("Total disconnected facets +: +0 ")))
        << admesh;
    EXPECT_TRUE(std::regex_search(admesh, std::regex("Number of parts +: +1 "))) << admesh;
    const std::string slicer = run_tool({"prusa-slicer", "--loglevel", "1", "--info", stl}).out;
    EXPECT_NE(slicer.find("manifold = yes"), std::string::npos) << part.name << '\n' << slicer;
    EXPECT_TRUE(std::regex_search(slicer, std::regex("number_of_parts = +1\n"))) << slicer;
    EXPECT_GT(solid(part.printed).volume, 100) << part.name << ", mm^3: inside out, or nothing";
  }
}

TEST_F(VariantParts, LieOnTheBedAndPrintWithoutSupports) {
  constexpr double kMaxBridge_mm = 10,
                   kStrandsInTheAir_mm2 = 3;  // at the crown of holes that lie
  for (const DrawnPart& part : sensor().parts) {
    EXPECT_NEAR(box(part.printed).min().z(), 0, 1e-3) << part.name;
    const Overhang worst =
        worst_overhang(part.printed, kToMm * parameters().printing.layer, kMaxBridge_mm);
    EXPECT_LE(worst.area, kStrandsInTheAir_mm2)
        << part.name << ": " << worst.area << " mm^2 hang in the air at " << worst.at.transpose();
  }
}

TEST_F(VariantParts, ComeWithAllThatABuilderNeeds) {
  for (const char* file : {"tags.pdf", "nano.svg", "no_board.svg", "bom.csv", "sensor.yaml",
                           "scenario.yaml", "parameters.scad", "contents.txt"})
    EXPECT_GT(read_file(folder() + "/" + file).size(), 50U) << file;
  const std::string listing = read_file(folder() + "/contents.txt");
  for (const DrawnPart& part : sensor().parts)
    EXPECT_NE(listing.find("\n" + part.name + " "), std::string::npos) << listing;
  EXPECT_TRUE(
      std::regex_search(listing, std::regex("\nall .* h .. min .*\nwhat to buy.* US dollars")))
      << listing;
}

TEST_F(VariantParts, AreShownInPictures) {
  if (std::getenv("TAGWRENCH_VARIANT_PICTURES") == nullptr) return;
  std::vector<std::string> views{"assembly", "exploded", "section"};
  for (int step = 1; step <= (sensor().has("puck_base") ? 8 : 7); ++step)
    views.push_back("step_" + std::to_string(step));
  for (const std::string& view : views) {
    const cv::Mat picture = cv::imread(folder() + "/" + view + ".png");
    ASSERT_FALSE(picture.empty()) << view;
    std::set<int> colours;
    int shown = 0;
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        const cv::Vec3b pixel = picture.at<cv::Vec3b>(y, x);
        if (pixel == picture.at<cv::Vec3b>(0, 0)) continue;
        ++shown;
        colours.insert((pixel[0] << 16) + (pixel[1] << 8) + pixel[2]);
      }
    }
    EXPECT_GT(shown, 0.05 * picture.rows * picture.cols) << view;
    EXPECT_GT(colours.size(), 8U) << view;
  }
}

TEST_F(VariantParts, ArePrintedInADay) {
  double hours = 0, grams = 0;
  for (const DrawnPart& part : sensor().parts) {
    EXPECT_GT(part.print_s, 60) << part.name;
    EXPECT_GT(part.filament_g, 0.1) << part.name;
    hours += part.print_s / 3600;
    grams += part.filament_g;
  }
  RecordProperty("print_hours", std::to_string(hours));
  RecordProperty("filament_g", std::to_string(grams));
  EXPECT_LT(hours, 12);
}

TEST_F(VariantParts, StandAsHighAndAsFarApartAsTheirFileSays) {
  const Mesh fixed = sensor().group(false, false), moving = sensor().group(true, false);
  EXPECT_NEAR(box(moving).max().z(), kToMm * geometry().top, kPrinted_mm);
  EXPECT_NEAR(box(fixed).min().z(), kToMm * geometry().bottom, kPrinted_mm);
  const MeshTree cover(sensor().part("camera_cover").there), hood(moving),
      plate(sensor().part("top_plate").there);
  // Gaps between the cover and what moves around it: from the middle of the gap, both ways.
  const double z = kToMm * geometry().cover_top - 1;
  const auto gap = [&](Eigen::Vector3d middle, Eigen::Vector3d out) {
    const auto outer = hood.first_hit(middle, out, 50), inner = cover.first_hit(middle, -out, 50);
    return outer && inner ? outer->distance + inner->distance : -1;
  };
  const hardware::Stops& stops = parameters().stops;
  const double gap_x = kToMm * std::max(stops.x, stops.gap);
  const double gap_y = kToMm * std::max(stops.y, stops.gap);
  const double in_y = kToMm * parameters().cover.y_half + 0.5 * gap_y;
  const double in_x = kToMm * parameters().cover.x_from - 0.5 * gap_x;
  EXPECT_NEAR(gap({0.1, in_y, z}, Eigen::Vector3d::UnitY()), gap_y, kPrinted_mm);
  EXPECT_NEAR(gap({0.1, -in_y, z}, -Eigen::Vector3d::UnitY()), gap_y, kPrinted_mm);
  EXPECT_NEAR(gap({in_x, 6.1, z}, -Eigen::Vector3d::UnitX()), gap_x, kPrinted_mm);
  // Springs: from one socket's bottom to the other's.
  for (const Eigen::Vector2d& at : geometry().springs) {
    const Eigen::Vector3d middle(kToMm * at.x() + 0.01, kToMm * at.y() + 0.02,
                                 kToMm * 0.5 * (geometry().cover_top + geometry().plate_bottom));
    const auto up = plate.first_hit(middle, Eigen::Vector3d::UnitZ());
    const auto down = cover.first_hit(middle, -Eigen::Vector3d::UnitZ());
    ASSERT_TRUE(up && down);
    EXPECT_NEAR(up->distance + down->distance, kToMm * parameters().springs.free_length,
                kPrinted_mm);
  }
}

TEST_F(VariantParts, HaveAFaceForEveryTagWhereTheProgramSeesIt) {
  const MeshTree moving(sensor().group(true, false));
  const double half = kToMm * (0.5 * parameters().target.tag_size + parameters().target.border);
  constexpr double kAway_mm = 1;
  for (const hardware::TagPlace& tag : geometry().tags) {
    const Eigen::Matrix3d turn = tag.platform_T_tag.linear();
    const Eigen::Vector3d middle =
        kToMm * (tag.platform_T_tag.translation() + Eigen::Vector3d(0, 0, geometry().platform));
    for (const double x : {-half, 0.0, half}) {
      for (const double y : {-half, 0.0, half}) {
        // The paper's z points into the roof.
        const Eigen::Vector3d before = middle + turn * Eigen::Vector3d(x, y, -kAway_mm);
        const auto hit = moving.first_hit(before, turn.col(2), 5);
        ASSERT_TRUE(hit) << "no plastic behind tag " << tag.id << " at " << x << ", " << y;
        EXPECT_NEAR(hit->distance, kAway_mm + kPaper_mm, kPrinted_mm) << "tag " << tag.id;
        EXPECT_LT(hit->normal.dot(turn.col(2)), -0.999) << "tag " << tag.id;
      }
    }
  }
}

TEST_F(VariantParts, WeighWhatTheSimulatorMoves) {
  // Plastic as sliced, spread evenly over each part; screws of steel.
  double mass = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  const auto add = [&](const Mesh& mesh, double grams) {
    const Solid s = solid(
        moved(Eigen::Isometry3d(Eigen::Translation3d(0, 0, -kToMm * geometry().platform)), mesh));
    mass += grams;
    first += grams * s.centre;
    second += grams / s.volume * s.second_moment;
  };
  for (const DrawnPart& part : sensor().parts)
    if (part.moves) add(part.there, part.filament_g);
  add(sensor().bought_moving, kSteel * solid(sensor().bought_moving).volume);
  const Eigen::Vector3d centre = first / mass;
  const Eigen::Matrix3d about = second - mass * centre * centre.transpose();
  const Eigen::Vector3d inertia = Eigen::Vector3d::Constant(about.trace()) - about.diagonal();
  const hardware::Moving& said = parameters().moving;
  EXPECT_NEAR(1e3 * said.mass, mass, 0.2 * mass) << "g";
  EXPECT_LT((kToMm * said.centre - centre).norm(), 2) << "mm; drawn: " << centre.transpose();
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(1e9 * said.inertia[axis], inertia[axis], 0.2 * inertia[axis])
        << "g mm^2, axis " << axis;
}

TEST_F(VariantParts, OfThePublishedSensorHaveItsDimensions) {
  if (parameters().name != "paper") return;
  // Ouyang & Howe, ICRA 2020: 36 x 31 x 51 mm, footprint 35.7 x 22.5 mm, shield 31 mm wide with
  // gaps of 2.5 mm, mounting plate 45 mm, lens to tags 21 mm, springs of 25.4 mm; four printed
  // parts.
  EXPECT_EQ(sensor().parts.size(), 4U);
  double hours = 0;  // "two to three"
  for (const DrawnPart& part : sensor().parts) hours += part.print_s / 3600;
  EXPECT_GT(hours, 1.5);
  EXPECT_LT(hours, 3);
  const Eigen::AlignedBox3d cover = box(sensor().part("camera_cover").there);
  const Eigen::AlignedBox3d shield = box(sensor().part("light_shield").there);
  const Eigen::AlignedBox3d mount = box(sensor().part("mounting_plate").there);
  constexpr double kRead_mm = 0.06;  // the paper gives tenths
  EXPECT_NEAR(cover.sizes().x(), 35.7, kRead_mm);
  EXPECT_NEAR(cover.sizes().y(), 22.5, kRead_mm);
  // Across its walls: the pads, in which the stop screws bite, stand out further down.
  const MeshTree roof(sensor().part("light_shield").there);
  const auto left = roof.first_hit({0.01, -100, 40}, Eigen::Vector3d::UnitY());
  const auto right = roof.first_hit({0.01, 100, 40}, -Eigen::Vector3d::UnitY());
  ASSERT_TRUE(left && right);
  EXPECT_NEAR(200 - left->distance - right->distance, 31, kRead_mm);
  EXPECT_NEAR(shield.max().z() - mount.min().z(), 51, kRead_mm);
  EXPECT_NEAR(mount.sizes().y(), 45, kRead_mm);
  // Lens to tags: up from the front of the lens to the faces behind the papers, at the papers'
  // middles.
  const MeshTree lens(sensor().bought_fixed);
  const auto down = lens.first_hit({0.01, 0.02, cover.max().z() + 10}, -Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(down);
  const double front = cover.max().z() + 10 - down->distance;
  for (const double y : {-1.697, 1.697}) {
    const auto up = roof.first_hit({0.01, y, front}, Eigen::Vector3d::UnitZ());
    ASSERT_TRUE(up);
    EXPECT_NEAR(up->distance, 21 + kPaper_mm * std::numbers::sqrt2, kRead_mm);
  }
}

}  // namespace
}  // namespace tagwrench::test
