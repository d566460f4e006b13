// Prints that are off as a whole: edges lie where printer, paper and glue put them.
#include "host/source/simulator/print_fault.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/source/simulator/prints.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench::sim {
namespace {

constexpr double kTexelsPerMetre = 200e3;
constexpr double kUm = 1e-6;
constexpr double kTolerance = 0.3e-6;  // m, a sixteenth of a texel

/// Sharp ink on white paper.
Target sharp() {
  Target target;
  target.ink_spread = target.ink_edge_roughness = target.ink_grain = target.paper_raggedness = 0;
  target.border = 0.6e-3;
  return target;
}

/// The black run of the tag's frame along one line of the print.
struct BlackRun {
  double length = 0;  ///< m
  double middle = 0;  ///< m
};

enum class Along { x, y };

/// `across`: where the line is, m. `from`, `to`: the part of it that is looked at.
BlackRun black_run(const Texture& print, const Target& target, Along along, double across,
                   double from, double to) {
  BlackRun run;
  const double step = 1 / print.texels_per_m;
  const auto at = [&](double place, double centre) {
    return static_cast<int>(std::lround(place * print.texels_per_m + centre));
  };
  double moment = 0;
  const int first = at(from, along == Along::x ? print.centre_u : print.centre_v);
  const int last = at(to, along == Along::x ? print.centre_u : print.centre_v);
  for (int i = first; i <= last; ++i) {
    const bool is_x = along == Along::x;
    const int u = is_x ? i : at(across, print.centre_u);
    const int v = is_x ? at(across, print.centre_v) : i;
    const double place = (i - (is_x ? print.centre_u : print.centre_v)) / print.texels_per_m;
    const double black = (target.paper_reflectance - print.texels[print.index(u, v)].reflectance) /
                         (target.paper_reflectance - target.ink_reflectance);
    run.length += black * step;
    moment += black * step * place;
  }
  run.middle = moment / run.length;
  return run;
}

struct Printed {
  Target target = sharp();
  PrintFault fault;
  double half = 0.5 * target.tag_size;
  double far = half + 0.3e-3;

  Texture print() const {
    return print_tag(target, fault, tag_cells(target.family, 5), kTexelsPerMetre, 1);
  }
  /// Through the frame's uppermost row of cells, which is black from edge to edge.
  double frame_row() const { return -half + target.tag_size / 14; }
  BlackRun row(const Texture& texture) const {
    return black_run(texture, target, Along::x, frame_row(), -far, far);
  }
  BlackRun column(const Texture& texture) const {
    return black_run(texture, target, Along::y, frame_row(), -far, far);
  }
};

PrintFault made(const Target& target, std::size_t tag = 0, std::uint64_t seed = 1) {
  return print_fault(target, tag, seed, {Eigen::Matrix3d::Identity(), {0, 0, 21e-3}});
}

TEST(PrintFault, OfATargetThatNamesNoneIsNone) {
  Printed tag;
  tag.fault = made(tag.target);
  EXPECT_EQ(tag.fault.drawn({1.1e-3, -0.7e-3}), Eigen::Vector2d(1.1e-3, -0.7e-3));
  const Texture print = tag.print();
  EXPECT_NEAR(tag.row(print).length, tag.target.tag_size, kTolerance);
  EXPECT_NEAR(tag.column(print).length, tag.target.tag_size, kTolerance);
}

TEST(PrintFault, SizeAndAspectStretchTheTag) {
  Printed tag;
  tag.target.print_size = 0.01;
  tag.target.print_aspect = 0.004;
  tag.fault = made(tag.target);
  const Texture print = tag.print();
  EXPECT_NEAR(tag.row(print).length, 1.014 * tag.target.tag_size, kTolerance);
  EXPECT_NEAR(tag.column(print).length, 1.006 * tag.target.tag_size, kTolerance);
}

TEST(PrintFault, ShearMovesRowsSidewaysByTheirHeight) {
  Printed tag;
  tag.target.print_shear = 0.01;
  tag.fault = made(tag.target);
  const BlackRun row = tag.row(tag.print());
  EXPECT_NEAR(row.middle, 0.01 * tag.frame_row(), kTolerance);
  EXPECT_NEAR(row.length, (1 - 0.01 * 0.01) * tag.target.tag_size, kTolerance);
}

TEST(PrintFault, InkGrowsAlongXAndAlongYByAsMuchAsSaid) {
  Printed tag;
  tag.target.ink_growth_x = 20 * kUm;
  tag.target.ink_growth_y = 5 * kUm;
  tag.fault = made(tag.target);
  const Texture print = tag.print();
  EXPECT_NEAR(tag.row(print).length, tag.target.tag_size + 40 * kUm, kTolerance);
  EXPECT_NEAR(tag.column(print).length, tag.target.tag_size + 10 * kUm, kTolerance);
}

TEST(PrintFault, CurledPaperIsSeenBesideItsPlaceWhereItStandsOffAndWhereOneLooksObliquely) {
  constexpr double kCurl = 30 * kUm;
  Printed tag;
  tag.target.paper_curl = kCurl;
  // The paper's z axis is turned by 45 degrees from the lens': looked at along (0, 1, 1).
  const double c = std::sqrt(0.5);
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, c, -c, 0, c, c;
  tag.fault = print_fault(tag.target, 0, 1, {rotation, {0, 0, 21e-3}});
  ASSERT_NEAR(tag.fault.sight.y(), 1, 1e-9);
  const Texture curled = tag.print();
  tag.fault.curl = 0;
  const Texture flat = tag.print();
  const auto moved = [&](double x) {  // of where the frame begins, m
    const auto bar = [&](const Texture& print) {
      return black_run(print, tag.target, Along::y, x, -tag.far, tag.frame_row()).length;
    };
    return bar(flat) - bar(curled);
  };
  EXPECT_NEAR(moved(0), kCurl, kTolerance) << "the middle of the bend";
  EXPECT_NEAR(moved(0.95 * tag.half), kCurl * (1 - 0.95 * 0.95), kTolerance);
}

TEST(PrintFault, DrawnOnesStayWithinTheirPartDifferFromTagToTagAndRepeat) {
  constexpr double kPart = 0.01;
  Target target = sharp();
  target.print_error = kPart;
  const double most = kPart * 0.5 * target.tag_size;
  double largest = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    for (std::size_t tag = 0; tag < 2; ++tag) {
      const PrintFault fault = made(target, tag, seed);
      const Eigen::Matrix2d off = fault.stretch - Eigen::Matrix2d::Identity();
      EXPECT_LE(std::abs(off.trace() / 2), kPart);            // size
      EXPECT_LE(std::abs(off(0, 0) - off(1, 1)) / 2, kPart);  // aspect
      EXPECT_LE(std::abs(off(0, 1)), kPart);
      EXPECT_GE(fault.growth.minCoeff(), 0);
      EXPECT_LE(fault.growth.maxCoeff(), most);
      EXPECT_LE(std::abs(fault.curl), most);
      largest = std::max(largest, off.cwiseAbs().maxCoeff());
    }
    EXPECT_NE(made(target, 0, seed).stretch, made(target, 1, seed).stretch);
    EXPECT_EQ(made(target, 0, seed).stretch, made(target, 0, seed).stretch);
  }
  EXPECT_GT(largest, 0.5 * kPart);
}

TEST(PrintFault, OfTheScenarioIsSeenInThePicture) {
  Scenario scenario;
  scenario.trajectory.motion = Motion::rest;
  const auto picture = [](const Scenario& of) {
    SimulatorSource source(of, /*live=*/false);
    Frame frame;
    source.read(frame);
    return std::vector<std::uint8_t>(frame.image.pixels, frame.image.pixels + 640 * 480);
  };
  const std::vector<std::uint8_t> exact = picture(scenario);
  scenario.target.print_error = 0.01;
  EXPECT_NE(picture(scenario), exact);
}

}  // namespace
}  // namespace tagwrench::sim
