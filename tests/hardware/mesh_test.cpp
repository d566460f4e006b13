// The rulers that the parts are measured with, on shapes whose numbers are known.
#include "tests/hardware/mesh.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

void add_quad(Mesh& mesh, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
              const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  mesh.push_back({a, b, c});
  mesh.push_back({a, c, d});
}

/// A prism with the outline `below` at z = from and `above` at z = to, counter-clockwise quads.
Mesh block(const std::array<Eigen::Vector2d, 4>& below, const std::array<Eigen::Vector2d, 4>& above,
           double from, double to) {
  std::array<Eigen::Vector3d, 4> b, t;
  for (std::size_t i = 0; i < 4; ++i) {
    b[i] << below[i], from;
    t[i] << above[i], to;
  }
  Mesh out;
  add_quad(out, b[3], b[2], b[1], b[0]);
  add_quad(out, t[0], t[1], t[2], t[3]);
  for (std::size_t i = 0; i < 4; ++i) add_quad(out, b[i], b[(i + 1) % 4], t[(i + 1) % 4], t[i]);
  return out;
}

std::array<Eigen::Vector2d, 4> rectangle(double x0, double y0, double x1, double y1) {
  return {Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y0), Eigen::Vector2d(x1, y1),
          Eigen::Vector2d(x0, y1)};
}

Mesh brick(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const auto outline = rectangle(from.x(), from.y(), to.x(), to.y());
  return block(outline, outline, from.z(), to.z());
}

Mesh together(Mesh a, const Mesh& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Mesh, ABrickHasTheMassPropertiesOfTheBook) {
  const Solid s = solid(brick({1, 2, 3}, {3, 6, 11}));
  EXPECT_NEAR(s.volume, 2 * 4 * 8, 1e-9);
  EXPECT_LT((s.centre - Eigen::Vector3d(2, 4, 7)).norm(), 1e-9);
  const Eigen::Matrix3d about = s.second_moment - s.volume * s.centre * s.centre.transpose();
  EXPECT_NEAR(about(0, 0), s.volume * 4 / 12, 1e-9);
  EXPECT_NEAR(about(2, 2), s.volume * 64 / 12, 1e-9);
  EXPECT_NEAR(about(0, 1), 0, 1e-9);
}

TEST(Mesh, ARayStopsAtTheFirstFace) {
  const MeshTree tree(together(brick({0, 0, 5}, {4, 4, 6}), brick({0, 0, 8}, {4, 4, 9})));
  const auto hit = tree.first_hit({1, 2, 0}, Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->distance, 5);
  EXPECT_LT((hit->normal + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_FALSE(tree.first_hit({1, 2, 0}, Eigen::Vector3d::UnitZ(), 4.9));
  EXPECT_FALSE(tree.first_hit({5, 2, 0}, Eigen::Vector3d::UnitZ()));
  EXPECT_TRUE(tree.contains({1, 1, 8.5}));
  EXPECT_FALSE(tree.contains({1, 1, 7}));
}

TEST(Mesh, SolidsCrossOnlyWhereTheyShareSpace) {
  const MeshTree tree(brick({0, 0, 0}, {10, 10, 10}));
  EXPECT_TRUE(tree.crossing(brick({9.99, 3, 3}, {12, 4, 4})));
  EXPECT_FALSE(tree.crossing(brick({10.01, 3, 3}, {12, 4, 4})));
  EXPECT_FALSE(tree.crossing(brick({10, 3, 3}, {12, 4, 4}))) << "faces that touch";
  EXPECT_FALSE(tree.crossing(brick({4, 4, 4}, {5, 5, 5}))) << "inside: no surfaces cross";
  EXPECT_TRUE(tree.contains({4, 4, 4}));
}

TEST(Mesh, OnlyABinaryStlIsRead) {
  const TemporaryFolder folder;
  write_file(folder / "ascii.stl", "solid a\nendsolid a\n" + std::string(200, ' '));
  EXPECT_THROW(read_stl(folder / "ascii.stl"), std::runtime_error);
  EXPECT_THROW(read_stl(folder / "none.stl"), std::runtime_error);
}

// Two pillars with a beam over them: `gap` between the pillars.
Mesh gate(double gap) {
  return together(together(brick({0, 0, 0}, {3, 5, 10}), brick({3 + gap, 0, 0}, {6 + gap, 5, 10})),
                  brick({0, 0, 10}, {6 + gap, 5, 12}));
}

TEST(Overhang, ABridgeHoldsUpToItsLength) {
  EXPECT_EQ(worst_overhang(gate(8), 0.2, 10).area, 0);
  EXPECT_NEAR(worst_overhang(gate(14), 0.2, 10).area, 14 * 5, 5);
}

TEST(Overhang, ABeamWithOneEndInTheAirDoesNotHold) {
  const Mesh arm = together(brick({0, 0, 0}, {3, 5, 10}), brick({0, 0, 10}, {7, 5, 12}));
  const Overhang worst = worst_overhang(arm, 0.2, 10);
  EXPECT_NEAR(worst.area, 4 * 5, 2);
  EXPECT_NEAR(worst.at.z(), 10.1, 0.11);
}

TEST(Overhang, SidesHoldUpTo45Degrees) {
  const auto foot = rectangle(0, 0, 10, 10);
  EXPECT_EQ(worst_overhang(block(foot, rectangle(-4.8, 0, 10, 10), 0, 5), 0.2, 10).area, 0);
  EXPECT_GT(worst_overhang(block(foot, rectangle(-8, 0, 10, 10), 0, 5), 0.2, 10).area, 1);
}

}  // namespace
}  // namespace tagwrench::test
